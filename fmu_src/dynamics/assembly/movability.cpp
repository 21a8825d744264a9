#include "dynamics/assembly/movability.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/compiled.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/joint_transform.hpp"

namespace redysim {
namespace {

// Rounding errors of an articulated inertia: rotational part, kg m^2; translational part, kg.
struct Rounding {
  double moment = 0, force = 0;
};

// A pivot below this multiple of its rounding error counts as zero.
constexpr double certain = 1e3;

Rounding rounding_of(const ArticulatedInertia<double>& A) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  return {epsilon * (std::abs(A.xx[0]) + std::abs(A.yy[0]) + std::abs(A.zz[0])),
          epsilon * (std::abs(A.xx[1]) + std::abs(A.yy[1]) + std::abs(A.zz[1]))};
}

// A characteristic length per joint, m: from its offsets and its body, or from the next outboard joints.
std::vector<double> lengths(const Plan<double>& plan) {
  std::vector<double> length(plan.joints.size());
  for (std::size_t i = length.size(); i-- > 0;) {
    const JointPlan<double>& joint = plan.joints[i];
    const RigidInertia<double>& body = joint.inertia;
    double own = std::max({std::abs(joint.a), std::abs(joint.b), std::abs(joint.d)});
    if (body.mass > 0)
      own = std::max(own, std::sqrt((body.inertia.xx + body.inertia.yy + body.inertia.zz) / body.mass));
    if (own > 0) length[i] = own;
    if (length[i] == 0) length[i] = 1;
    if (joint.parent == ground) continue;
    double& parent = length[static_cast<std::size_t>(joint.parent)];
    parent = parent > 0 ? std::min(parent, length[i]) : length[i];
  }
  return length;
}

}  // namespace

std::vector<double> joint_inertias(const Plan<double>& plan, Workspace<double>& ws, const double* q) {
  // at rest; a singular joint gives infinite accelerations, which only affect joints inboard of it
  const std::vector<double> rest(static_cast<std::size_t>(InputLayout(plan).recursion_size()));
  std::vector<double> inertias(plan.joints.size());
  compiled_forward_dynamics(plan, ws, q, rest.data(), rest.data(), inertias.data());
  std::vector<Rounding> inherited(plan.joints.size());
  for (std::size_t i = plan.joints.size(); i-- > 0;) {
    const JointPlan<double>& joint = plan.joints[i];
    const JointState<double>& s = ws.joints[i];
    Rounding error = rounding_of(s.A);
    error.moment += inherited[i].moment;
    error.force += inherited[i].force;
    const double pivot = axis_inertia(joint, s.A.zz) + joint.armature;
    inertias[i] = pivot > certain * largest_squared(joint, error.moment, error.force) ? pivot : 0;
    if (joint.parent == ground) continue;
    Mat3<double> rotation;
    Vec3<double> position;
    joint_pose(joint, s, rotation, position);
    inherited[joint.parent].moment += error.moment + position.squaredNorm() * error.force;
    inherited[joint.parent].force += error.force;
  }
  return inertias;
}

int singular_joint(const Plan<double>& plan, Workspace<double>& ws, const double* q) {
  const std::vector<double> inertias = joint_inertias(plan, ws, q);
  for (std::size_t i = inertias.size(); i-- > 0;)
    if (inertias[i] == 0 && !plan.joints[i].prescribed) return static_cast<int>(i);
  return -1;
}

int always_singular_joint(const Plan<double>& plan, Workspace<double>& ws) {
  int found = -1;
  const std::vector<double> length = lengths(plan);
  std::vector<double> q(plan.joints.size());
  for (int attempt = 1; attempt <= 3; ++attempt) {
    // quasi-random angles and displacements; spherical joints stay within their chart
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double share = std::fmod(0.7548776662466927 * static_cast<double>(i + 1) * attempt, 1.0);
      q[i] = plan.joints[i].prescribed ? 0 : plan.joints[i].of_ball ? 0.5 * share : 0.3 + 2 * share;
      if (!turns(plan.joints[i])) q[i] *= length[i];
    }
    found = singular_joint(plan, ws, q.data());
    if (found < 0) break;
  }
  return found;
}

}  // namespace redysim
