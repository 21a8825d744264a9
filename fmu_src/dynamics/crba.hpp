#pragma once

#include "dynamics/joint_elimination.hpp"

namespace redysim {

// Joint-space inertia matrix of the open tree by composite bodies (Featherstone 2008, Table 6.2),
// nv x nv, armature on the diagonal, both triangles. Uses q; overwrites positions, A and p.
template <class Scalar>
void joint_space_inertia(const Plan<Scalar>& plan, Workspace<Scalar>& ws, const Scalar* q,
                         Eigen::Ref<Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>> M) {
  set_positions(plan, ws, q);
  for (std::size_t i = 0; i < plan.joints.size(); ++i) ws.joints[i].A = plan.joints[i].rigid;
  M.setZero();
  for (int i = static_cast<int>(plan.joints.size()) - 1; i >= 0; --i) {
    const JointPlan<Scalar>& joint = plan.joints[i];
    JointState<Scalar>& s = ws.joints[i];
    // wrench of a unit acceleration of joint i, transmitted to every joint between it and the ground
    set_pivot(joint, s, Scalar(0));
    Force<Scalar> f = s.U;
    M(i, i) = generalized_force(joint, f) + joint.armature;
    for (int j = i; plan.joints[j].parent != ground;) {
      to_parent(plan.joints[j], ws.joints[j], f);
      j = plan.joints[j].parent;
      M(i, j) = M(j, i) = generalized_force(plan.joints[j], f);
    }
    if (joint.parent == ground) continue;
    ArticulatedInertia<Scalar> A = s.A;
    to_parent(joint, s, A);
    add(ws.joints[joint.parent].A, A);
  }
}

}  // namespace redysim
