#pragma once

#include <memory>
#include <vector>

#include "dynamics/loops/cluster_rows.hpp"
#include "integrate/system/system.hpp"
#include "integrate/system/tangent.hpp"

namespace redysim {

// Numbers of independent joints of each cluster of a plan: at the start of the model, or next to it where the
// start is singular. Sets the prescribed motions of the system.
std::vector<int> independent_joints(const Model& model, const Parameters<double>& parameters, System& system);

// The states of a master of model exchange: y with independent coordinates in place of the joints in loops
// and rigid couplings, which depend on them (Wehage and Haug 1982). Positions and velocities of some of these
// joints are the independent ones; of a spherical joint one of its angles in a chart that is kept.
class IndependentCoordinates {
 public:
  // Pivot of a direction in which dependent joints keep their motion.
  static constexpr double singular = 1e-9;

  // `counts`: independent_joints.
  IndependentCoordinates(const Model& model, System& system, const std::vector<int>& counts);
  IndependentCoordinates(const IndependentCoordinates&) = delete;
  IndependentCoordinates& operator=(const IndependentCoordinates&) = delete;

  int count() const { return static_cast<int>(entries_.size()); }  // of independent positions
  int size() const { return static_cast<int>(kept_.size()) + 2 * count(); }
  const std::vector<int>& kept() const { return kept_; }            // entries of y, ascending
  const std::vector<int>& dependent() const { return dependent_; }  // the other ones
  int joint(int k) const { return entries_[k].joint; }              // of the plan
  void nominals(double* states) const;

  // Chooses those of which the others depend least, at a state that satisfies the constraints.
  void choose(double time, const double* y);
  // Whether a dependent joint moves much more than the independent ones, in the units of the joints, and
  // other coordinates would be better.
  bool should_choose(double time, const double* y);

  // Position, velocity and acceleration of an independent joint.
  struct Motion {
    double q, qd, qdd;
  };
  Motion motion(int k, const double* y, const double* ydot = nullptr) const;
  struct Direction {
    Dual q, qd, qdd;
  };
  Direction direction(int k, const double* y, const Tangent& tangent) const;

  // Positions of the prescribed joints in clusters.
  std::vector<double> driven(double time, const double* y) const;
  // Moves the dependent entries of y, at which prescribed joints were `driven`, to those that satisfy the
  // constraints. False: there are none on the way.
  bool close(double time, const double* q, const double* qd, const std::vector<double>& driven, double* y);
  bool was_far() const { return was_far_; }  // the last point that was closed, in more than one move
  // Coordinates of all joints in clusters, in the kept charts, with the directions of the independent ones.
  void seed(const double* y, const double* dq, const double* dqd, std::vector<Dual>& q,
            std::vector<Dual>& qd) const;
  const std::vector<int>& dependent_joints(std::size_t cluster) const {
    return clusters_[cluster]->dependent;
  }

  // The choice, as numbers. false: as many numbers, but no choice for this plan.
  std::vector<double> choice() const;
  bool restore(const std::vector<double>& choice);

 private:
  struct Entry {
    int joint = -1;           // of the plan
    int ball = -1, axis = 0;  // of a spherical joint; else
    int place = 0;            // among the simple ones
  };
  struct Cluster {
    ClusterRows<double> rows;
    int first, count;                    // of the independent ones
    std::vector<int> dependent, driven;  // joints of the plan
    int rank() const { return static_cast<int>(rows.free_joints().size()) - count; }
  };
  Entry entry(int joint) const;
  struct BallMotion {
    BallAngles angles;
    Vec3<double> rates;
  };
  bool is_in_cluster(int ball) const { return in_cluster_[system_.plan().balls[ball] + 1] != 0; }
  BallMotion motion_of(int ball, const double* y) const;
  void expand(double time, const double* y);
  void take(const std::vector<char>& independent);  // per joint of the plan
  bool solve_positions(Cluster& cluster, std::vector<double>& q);
  bool follow_positions(Cluster& cluster, const double* q, const double*& driven);
  bool solve_velocities(Cluster& cluster);

  System& system_;
  Workspace<double> workspace_;
  std::vector<std::unique_ptr<Cluster>> clusters_;
  std::vector<Entry> entries_;
  std::vector<int> kept_, dependent_;
  std::vector<char> turned_;        // charts of the spherical joints
  std::vector<char> in_cluster_;    // per joint of the plan: free in a cluster
  std::vector<double> q_, qd_, y_;  // of all joints, in these charts
  bool was_far_ = false;
};

}  // namespace redysim
