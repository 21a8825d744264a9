#pragma once

#include <memory>
#include <vector>

#include "dynamics/loops/cluster_rows.hpp"
#include "integrate/system/system.hpp"
#include "integrate/system/tangent.hpp"

namespace redysim {

class CompletePivoting;

// Number of independent joints in each cluster of a plan, at the start of the model, or close to it if the
// start is singular. Also sets the prescribed motions of the system.
std::vector<int> independent_joints(const Model& model, const Parameters<double>& parameters, System& system);

// States of model exchange: y with independent coordinates instead of the joints in loops and rigid
// couplings, which depend on these (Wehage and Haug 1982). They are the positions and velocities of some of
// these joints; for a spherical joint, angles in a fixed chart.
class IndependentCoordinates {
 public:
  // Pivots below this value count as zero: dependent joints keep their motion in these directions.
  static constexpr double singular = 1e-9;

  // `counts`: from independent_joints.
  IndependentCoordinates(const Model& model, System& system, const std::vector<int>& counts);
  IndependentCoordinates(const IndependentCoordinates&) = delete;
  IndependentCoordinates& operator=(const IndependentCoordinates&) = delete;

  int count() const { return static_cast<int>(entries_.size()); }  // number of independent positions
  int size() const { return static_cast<int>(kept_.size()) + 2 * count(); }
  int rank() const;  // of the constraints, except in singular configurations
  const std::vector<int>& kept() const { return kept_; }            // entries of y that are states, ascending
  const std::vector<int>& dependent() const { return dependent_; }  // the other entries of y
  int joint(int k) const { return entries_[k].joint; }              // index into the plan
  void nominals(double* states) const;

  // Chooses the coordinates on which the others depend least, at a state that satisfies the constraints.
  void choose(double time, const double* y);
  // How many times as much as the independent joints a dependent joint moves, in the units of the joints; the
  // same of the charts of spherical joints. 0 if it is more than `usual` and no other choice is better.
  // Limits: of a choice at a completed step, of an event, of a warning.
  static constexpr double usual = 5, event = 10, nearly_singular = 50;
  double leverage(double time, const double* y);

  // Position, velocity and acceleration of an independent joint.
  struct Motion {
    double q, qd, qdd;
  };
  Motion motion(int k, const double* y, const double* ydot = nullptr) const;
  struct Direction {
    Dual q, qd, qdd;
  };
  Direction direction(int k, const double* y, const Tangent& tangent) const;

  // Positions of the prescribed joints in clusters, in the order of the clusters.
  std::vector<double> driven(double time, const double* y) const;
  // Sets the dependent entries of y to values that satisfy the constraints, for independent positions q and
  // velocities qd. `driven`: positions of prescribed joints at the given y. False: no solution along the
  // path.
  bool close(double time, const double* q, const double* qd, const std::vector<double>& driven, double* y);
  bool was_far() const { return was_far_; }  // the last `close` needed more than one move
  // Sets q and qd of all joints in clusters, in the fixed charts, with the directions of the independent
  // ones.
  void seed(const double* y, const double* dq, const double* dqd, std::vector<Dual>& q,
            std::vector<Dual>& qd) const;
  const std::vector<int>& dependent_joints(std::size_t cluster) const {
    return clusters_[cluster]->dependent;
  }

  // The choice as numbers. False: not a valid choice for this plan; `choice` has the same length.
  std::vector<double> choice() const;
  bool restore(const std::vector<double>& choice);

 private:
  struct Entry {
    int joint = -1;           // index into the plan
    int ball = -1, axis = 0;  // of a spherical joint, otherwise -1
    int place = 0;            // index among the simple joints
  };
  struct Cluster {
    ClusterRows<double> rows;
    int first, count;                    // range of its independent coordinates
    std::vector<int> dependent, driven;  // indices into the plan
    int rank() const { return static_cast<int>(rows.free_joints().size()) - count; }
    [[gnu::noinline]] CompletePivoting factor() const;
  };
  struct Way {  // of an independent or prescribed joint
    int joint;
    double from, to, length;
  };
  Entry entry(int joint) const;
  struct BallMotion {
    BallAngles angles;
    Vec3<double> rates;
  };
  bool is_in_cluster(int ball) const { return in_cluster_[system_.plan().balls[ball] + 1] != 0; }
  BallMotion motion_of(int ball, const double* y) const;
  void expand(double time, const double* y);
  void take(const std::vector<char>& independent);  // one entry per joint of the plan
  double solve_positions(Cluster& cluster, std::vector<double>& q);
  [[gnu::cold]] bool crosses_singular(Cluster& cluster, const std::vector<double>& q);
  bool move(Cluster& cluster, const std::vector<Way>& ways, double span, bool* rejected);
  bool follow_positions(Cluster& cluster, const double* q, const double*& driven);
  bool solve_velocities(Cluster& cluster);

  System& system_;
  Workspace<double> workspace_;
  std::vector<std::unique_ptr<Cluster>> clusters_;
  std::vector<Entry> entries_;
  std::vector<int> kept_, dependent_;
  std::vector<char> turned_;        // charts of the spherical joints
  std::vector<char> in_cluster_;    // per joint of the plan: it is free and in a cluster
  std::vector<double> q_, qd_, y_;  // of all joints, in these charts
  bool was_far_ = false;
};

}  // namespace redysim
