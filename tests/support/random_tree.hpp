#pragma once

#include <random>
#include <vector>

#include "model/model.hpp"

// Random models for the property tests. Everything follows from the seed, which a test prints.

namespace redysim::test {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double between(double low, double high);
  int index(int count);
  bool chance(double probability);
  Vec3<double> vector(double size);
  Vec3<double> direction();
  std::vector<double> numbers(int count, double size);

 private:
  std::mt19937 engine_;
};

struct TreeOptions {
  int links = 8;
  bool branches = true;
  bool prismatic = true;
  bool screws = true;
  bool fixed = true;
  bool right_angles = false;  // alpha only from 0, 90, -90, 180 deg
  bool passive = true;        // springs and dampers in joints, armature
  bool resistance = true;     // friction and stops in joints
  bool springs = true;        // spring-dampers between points
  bool massless = true;       // some links without inertia in front of a link with inertia
};

// Principal moments that a mass distribution can have, turned into random axes.
void give_inertia(Random& random, Link& link);

// Friction and stops, mild enough for differences to see them; those of half the joints are pressed at random
// q.
void give_resistance(Random& random, Joint& joint);

SpringDamper random_spring(Random& random, int links);

Bushing random_bushing(Random& random, int links);

Model random_tree(Random& random, const TreeOptions& options);

// The geometries a law must hold for, one random model for each seed.
TreeOptions options_of(unsigned seed);

inline constexpr unsigned tree_seeds = 60;

}  // namespace redysim::test
