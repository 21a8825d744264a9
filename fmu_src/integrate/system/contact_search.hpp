#pragma once

#include <algorithm>
#include <vector>

#include "dynamics/contact/contact_force.hpp"

namespace redysim {

// Finds when contact points first touch in a predicted motion, so that no step misses a contact.
//
// Joints are predicted by Taylor polynomials of order 2. The change of the joints since a reference bounds
// the displacement of the bodies, which excludes contact points that are further away. For the others, poses
// and distances are computed at the ends of segments in which no joint turns more than half a radian and no
// point passes more than half the spacing of a height map. A segment is halved where the tangents of a
// distance at both ends do not exclude a touch (conservative advancement). Works without allocation after
// construction.
class ContactSearch {
 public:
  [[gnu::cold]] explicit ContactSearch(const Plan<double>& plan);

  // The part, s, of the step `h` from q, qd with the accelerations qdd (all of length plan.nv) that ends
  // before one of these: a separated contact point penetrates by more than a hundredth of the width of its
  // law, or a touching point becomes much deeper. Returns `h` if neither happens. `or_separation`: also ends
  // before a touching point rises by more than half its depth. Overwrites the ground motion in the workspace.
  double step_to_touch(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                       const double* qdd, double h, bool or_separation);

  // Call after this step of `h` s, which ended at q, qd. Returns the part, s, until a point touched that is
  // separated at both ends, by the cubic through its actual distances and rates; `h` if none did. Overwrites
  // the ground motion in the workspace.
  double passed_touch(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                      double h);

 private:
  // Bounds of the displacement of a body's origin and of its rotation since the reference, m and rad.
  struct Displacement {
    double moved, turned;
    double of_point(double arm) const { return moved + std::min(turned, 2.0) * arm; }
  };
  // A pair at the reference: its separation, and the distance of its points from the carrier of the surface,
  // m.
  struct ReferencePair {
    double separation, carrier_arm;
  };
  struct NearPair {
    const ContactPair<double>* pair;
    std::size_t first_point;
    double moved;  // bound of the displacement of its points relative to the surface, m
  };

  struct Course;

  Course course(const ContactDistance& from, std::size_t point, double length) const;
  void predict_balls(const Plan<double>& plan, const double* qdd, double after);
  void predict(const Plan<double>& plan, Workspace<double>& ws, const double* qdd, double after);
  double travel(std::size_t joint, const double* qdd, double h) const;
  void set_reference(const Plan<double>& plan, const Workspace<double>& ws);
  bool find_near_pairs(const Plan<double>& plan, const double* qdd, double h);
  Displacement displacement_of(int body) const {
    return body == ground ? Displacement{0, 0} : displacements_[static_cast<std::size_t>(body)];
  }
  void set_distances(const Workspace<double>& ws, std::vector<ContactDistance>& distances);
  double find_waiting_points(double h, bool or_separation);
  double search(const Plan<double>& plan, Workspace<double>& ws, const double* qdd, double h);
  double part_to_touch(double length, bool may_be_shorter) const;

  std::vector<double> start_q_, start_qd_, q_, qd_;
  std::vector<double> reference_q_, arms_;  // arms_: per body, distance of its origin from its parent's, m
  std::vector<ReferencePair> reference_pairs_;
  std::vector<Displacement> displacements_;      // per body
  std::vector<NearPair> near_;                   // pairs that may touch in the step
  std::vector<std::size_t> waiting_;             // their points that may begin to touch
  std::vector<ContactDistance> before_, after_;  // of all contact points
  std::vector<ContactDistance> start_;           // of the waiting points at the start of the step
  std::vector<double> pressed_;                  // depth at which a step may end, per point, m
};

}  // namespace redysim
