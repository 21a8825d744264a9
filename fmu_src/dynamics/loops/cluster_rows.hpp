#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "dynamics/bias.hpp"
#include "dynamics/loops/coupling_rows.hpp"
#include "math/dual.hpp"

namespace redysim {

// Joints that count as free: those that the assembly may move, those that are not prescribed, or all.
enum class FreeJoints { assembled, integrated, all };

// The rows of one cluster in one configuration: residuals phi, their Jacobian J with respect to the free
// joints, and rates. The unit of length is the size of the mechanism. Uses the pose of the cluster's root in
// the workspace.
template <class Scalar>
class ClusterRows {
 public:
  using Rows = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

  ClusterRows(const Model& model, const Plan<Scalar>& plan, Workspace<Scalar>& ws, const ClusterPlan& cluster,
              FreeJoints free = FreeJoints::assembled)
      : plan_(plan), ws_(ws), cluster_(cluster) {
    column_.assign(plan.joints.size(), -1);
    // cluster.joints are descending
    for (auto joint = cluster.joints.rbegin(); joint != cluster.joints.rend(); ++joint) {
      joints_.push_back(*joint);
      const JointPlan<Scalar>& at = plan.joints[*joint];
      if (free == FreeJoints::all ? at.prescribed && at.of_ball : at.prescribed) continue;
      if (free == FreeJoints::assembled && model.links[at.link].joint.hold) continue;
      column_[*joint] = static_cast<int>(free_.size());
      free_.push_back(*joint);
    }
    q_.assign(plan.joints.size(), Scalar(0));
    qd_ = q_;
    phi_.resize(cluster.row_count);
    rate_.resize(cluster.row_count);
    J_.resize(cluster.row_count, static_cast<Eigen::Index>(free_.size()));
  }

  const std::vector<int>& joints() const { return joints_; }
  const std::vector<int>& free_joints() const { return free_; }
  double unit(int joint) const { return turns(plan_.joints[joint]) ? 1.0 : size_; }
  double rounding() const { return rounding_; }
  const LoopPlan<Scalar>& loop(int k) const { return plan_.loops[cluster_.first_loop + k]; }
  const CouplingPlan& coupling(int k) const { return plan_.couplings[cluster_.first_coupling + k]; }
  int loop_count() const { return cluster_.loop_count; }
  int coupling_count() const { return cluster_.coupling_count; }

  const Rows& residuals() const { return phi_; }
  const Rows& rates() const { return rate_; }
  const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& jacobian() const { return J_; }

  // Values of the columns of these free joints.
  Eigen::MatrixXd jacobian(const std::vector<int>& joints) const {
    Eigen::MatrixXd columns(J_.rows(), static_cast<Eigen::Index>(joints.size()));
    for (std::size_t k = 0; k < joints.size(); ++k)
      for (Eigen::Index row = 0; row < J_.rows(); ++row)
        columns(row, k) = value_of(J_(row, column_[joints[k]]));
    return columns;
  }

  // q: per joint of the plan.
  void set_pose(const Scalar* q) {
    for (int i : joints_) set_position(i, q[i]);
    set_poses();
  }

  // Sets the unit of length: the root mean square distance of the cluster's points from its root (on the
  // ground: from its first joint). Unlike the maximum distance, it is a smooth function of q. If all points
  // coincide, it is the size of the bodies, without a derivative (the result is NaN).
  Scalar measure() {
    using std::sqrt;
    if (!has_loops()) return measure_couplings();
    const Vec3<Scalar> origin = origin_of_root();
    Scalar squared(0);
    double farthest = 0;
    const auto include = [&](const Vec3<Scalar>& point) { squared += (point - origin).squaredNorm(); };
    for (int i : joints_) {
      include(ws_.ground[i].position);
      farthest = std::max(farthest, LoopMagnitudes::size(ws_.ground[i].position));
    }
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopGeometry<Scalar> g = loop_geometry(loop(k), ws_);
      include(g.point_a.position);
      include(g.point_b.position);
      farthest = std::max(farthest, loop(k).summand);
      for (const auto* term :
           {&g.point_a.position, &g.point_b.position, &g.point_a.arm, &g.point_b.arm, &g.root.position})
        farthest = std::max(farthest, LoopMagnitudes::size(*term));
    }
    const double points = static_cast<double>(joints_.size()) + 2.0 * cluster_.loop_count;
    const double extent = body_extent();
    size_ = std::sqrt(value_of(squared) / points);
    const bool is_point = size_ <= 1e-9 * extent || size_ == 0;
    if (is_point) size_ = extent > 0 ? extent : 1;
    row_size_ = std::ldexp(1.0, std::ilogb(1.5 * size_));
    rounding_ = 1e-13 + 1e-15 * farthest / size_;
    return is_point ? Scalar(std::numeric_limits<double>::quiet_NaN())
                    : Scalar(sqrt(squared / Scalar(points)));
  }

  // qd: per joint of the plan.
  void set_motion(const Scalar* qd) {
    for (int i : joints_) {
      qd_[i] = qd[i];
      if (has_loops()) ws_.ground[i] = moved(plan_.joints[i], ws_.joints[i], parent_of(i), qd[i]);
    }
    set_rows();
  }

  // Sets residuals, rates and Jacobian at the poses and velocities of the bodies: J_rj = S_j . w, with w the
  // wrench of the row transmitted along both paths.
  void set_rows() {
    J_.setZero();
    for (int k = 0; k < cluster_.loop_count; ++k) {
      const LoopPlan<Scalar>& at = loop(k);
      const LoopGeometry<Scalar> g = loop_geometry(at, ws_);
      for (std::size_t r = 0; r < at.rows.size(); ++r) {
        const RowValues<Scalar> values = row_values(g, at.rows[r]);
        const double scale = 1 / row_unit(at.rows[r]);
        const int row = local_row(k, r);
        phi_[row] = values.residual * scale;
        rate_[row] = values.rate * scale;
        add_path(row, at.body_a, values.on_a, scale);
        add_path(row, at.body_b, values.on_b, scale);
      }
    }
    for (int k = 0; k < cluster_.coupling_count; ++k) set_coupling_row(coupling(k));
  }

 protected:
  bool has_loops() const { return cluster_.loop_count > 0; }

  void set_position(int joint, const Scalar& q) {
    q_[joint] = q;
    set_joint_position(plan_.joints[joint], q, ws_.joints[joint]);
  }

  // Without loops there are no points: the unit of length is the maximum scale of the prismatic joints.
  Scalar measure_couplings() {
    size_ = 0;
    for (int k = 0; k < cluster_.coupling_count; ++k)
      for (std::size_t n = 0; n < coupling(k).joints.size(); ++n)
        if (!turns(plan_.joints[coupling(k).joints[n]]))
          size_ = std::max(size_, plan_.joint_units[coupling(k).joints[n]]);
    if (size_ == 0) size_ = 1;
    row_size_ = 1;
    rounding_ = 1e-13;
    return Scalar(size_);
  }

  // Unit of a coupling row: its maximum lever in units of the joints.
  double row_unit(const CouplingPlan& row) const {
    double largest = 0;
    for (std::size_t k = 0; k < row.joints.size(); ++k)
      largest = std::max(largest, std::abs(row.ratios[k]) * unit(row.joints[k]));
    return largest;
  }

  void set_coupling_row(const CouplingPlan& at) {
    const double scale = 1 / row_unit(at);
    const int row = local_row(at);
    phi_[row] = coupling_sum(at, q_.data(), at.offset) * scale;
    rate_[row] = coupling_sum(at, qd_.data(), 0.0) * scale;
    for (std::size_t k = 0; k < at.joints.size(); ++k)
      if (column_[at.joints[k]] >= 0)
        J_(row, column_[at.joints[k]]) += at.ratios[k] * unit(at.joints[k]) * scale;
  }

  static bool is_rotation(const ConstraintRow<Scalar>& row) {
    return row.kind == ConstraintRow<Scalar>::Kind::rotation;
  }
  double row_unit(const ConstraintRow<Scalar>& row) const { return is_rotation(row) ? 1.0 : row_size_; }
  int local_row(int k, std::size_t r) const {
    return loop(k).first_row - cluster_.first_row + static_cast<int>(r);
  }

  int local_row(const CouplingPlan& at) const { return at.row - cluster_.first_row; }

  // State of a joint's parent; positions are relative to the cluster's root.
  const GroundState<Scalar>& parent_of(int joint) const {
    const int parent = plan_.joints[joint].parent;
    return ground_state(ws_, parent == cluster_.root ? cluster_.root_entry : parent);
  }

  // Origin for `measure`; on the ground: the position of the first joint.
  Vec3<Scalar> origin_of_root() const {
    if (cluster_.root != ground) return Vec3<Scalar>::Zero();
    const int first = joints_.front();
    const GroundState<Scalar>& body = ws_.ground[first];
    return body.position - body.rotation.col(2) * (ws_.joints[first].offset - plan_.joints[first].d);
  }

  // Maximum radius of gyration of the bodies about their origins, m.
  double body_extent() const {
    double extent = 0;
    for (int i : joints_) {
      const RigidInertia<Scalar>& body = plan_.joints[i].inertia;
      const double trace = value_of(body.inertia.xx) + value_of(body.inertia.yy) + value_of(body.inertia.zz);
      if (value_of(body.mass) > 0) extent = std::max(extent, std::sqrt(trace / value_of(body.mass)));
    }
    return extent;
  }

  void set_poses() {
    if (!has_loops()) return;
    for (int i : joints_) ws_.ground[i] = moved(plan_.joints[i], ws_.joints[i], parent_of(i), Scalar(0));
  }

  void add_path(int row, int body, Force<Scalar> w, double scale) {
    for (; body != cluster_.root; body = plan_.joints[body].parent) {
      const JointPlan<Scalar>& joint = plan_.joints[body];
      if (column_[body] >= 0) J_(row, column_[body]) += generalized_force(joint, w) * (scale * unit(body));
      to_parent(joint, ws_.joints[body], w);
    }
  }

  const Plan<Scalar>& plan_;
  Workspace<Scalar>& ws_;
  const ClusterPlan& cluster_;
  std::vector<int> joints_, free_;  // indices into the plan, parents first
  std::vector<int> column_;         // per joint of the plan: column of J, or -1
  double size_ = 0;                 // m
  double row_size_ = 0;             // a power of two near size_: division causes no rounding
  double rounding_ = 0;             // rounding error of J_, whose entries are at most about 1
  std::vector<Scalar> q_, qd_;      // per joint of the plan
  Rows phi_, rate_;
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> J_;
};

}  // namespace redysim
