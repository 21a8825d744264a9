#pragma once

#include <vector>

#include "dynamics/contact/contact_force.hpp"

namespace redysim {

// Finds when contact points first touch on a predicted motion, so that no step passes a contact unseen.
//
// Joints are predicted by Taylor polynomials of order 2, poses and distances of all contact points by their
// exact kinematics at the ends of segments in which no joint turns more than half a radian. A segment is
// halved where the tangents of a distance at both ends do not exclude a touch (conservative advancement).
// Works without allocation after construction.
class ContactSearch {
 public:
  explicit ContactSearch(const Plan<double>& plan);

  // Of the step `h` (s) from q, qd, qdd (plan.nv): the part until the first contact point that does not touch
  // now is pressed by a hundredth of the width of its law, and so that no touching point is pressed much
  // deeper; `h` if there is none. Uses the ground motion at q and qd in the workspace, and overwrites it.
  double step_to_touch(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                       const double* qdd, double h);

 private:
  void predict(const Plan<double>& plan, Workspace<double>& ws, const double* qdd, double after,
               std::vector<ContactDistance>& distances);

  double note_touching(double h);
  double part_to_touch(double length, bool may_be_shorter) const;

  std::vector<double> start_q_, start_qd_, q_, qd_;
  std::vector<ContactDistance> before_, after_;  // of all contact points
  std::vector<double> pressed_;                  // depth at which a step may end, m
  std::vector<char> touching_;                   // at the start of the step
};

}  // namespace redysim
