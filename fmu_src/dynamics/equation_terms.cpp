#include "dynamics/equation_terms.hpp"

#include <algorithm>

#include "dynamics/ball.hpp"
#include "dynamics/joint_wrenches.hpp"
#include "model/any_of.hpp"

namespace redysim {
namespace {

constexpr OutputGroup groups[] = {OutputGroup::gravity_torque, OutputGroup::coriolis, OutputGroup::bias,
                                  OutputGroup::passive, OutputGroup::mass_matrix};

template <class Scalar>
BallAnglesOf<Scalar> angles_at(const Scalar* chart) {
  return {false, chart[1], chart[2], chart[3]};
}

bool has_inertia(const Frame& frame) { return frame.inverse_inertia; }

bool has_jacobian(const Frame& frame) {
  return frame.jacobian || frame.jacobian_rate || frame.inverse_inertia;
}

bool needs_bodies(const Model& model) { return any_of(model.frames, has_jacobian); }

// The link axes x, y, z of a spherical joint are the axes y, z, x of its last joint's body.
template <class Scalar>
Vec3<Scalar> in_link_axes(const Vec3<Scalar>& of_body) {
  return {of_body.y(), of_body.z(), of_body.x()};
}

}  // namespace

template <class Scalar>
bool EquationTerms<Scalar>::needed(const Model& model) {
  return needs_bodies(model) || model.fmu.outputs.has_any_from(OutputGroup::mass_matrix);
}

template <class Scalar>
EquationTerms<Scalar>::EquationTerms(const Model& model, const Plan<Scalar>& plan)
    : plan_(plan), workspace_(plan) {
  const std::size_t joints = plan.joints.size(), n = joints - plan.balls.size();
  const bool factored = any_of(model.frames, has_inertia);
  const auto length = [&](int term) {
    if (term == mass) return model.fmu.shows(groups[term]) || factored ? n * n : 0;
    return model.fmu.shows(groups[term]) ? n : 0;
  };
  std::size_t size = 5 * joints;
  for (int term = 0; term < count; ++term) size += length(term);
  numbers_.resize(size + (factored ? n * (n + 2) : 0));
  rest_ = numbers_.data();
  q_ = rest_ + joints;
  qd_ = q_ + joints;
  now_ = qd_ + joints;
  qdd_ = now_ + joints;
  Scalar* next = qdd_ + joints;
  for (int term = 0; term < count; next += length(term++)) terms_[term] = next;
  factor_ = next;
  if (needs_bodies(model)) bodies_ = std::make_unique<GroundState<Scalar>[]>(joints);
  if (model.fmu.shows(OutputGroup::reaction)) reactions_ = std::make_unique<Force<Scalar>[]>(joints);
}

template <class Scalar>
void EquationTerms<Scalar>::go_to(const Scalar* q, const Scalar* qd, const Scalar* qdd, const Scalar* ports,
                                  const std::vector<Scalar>& lambda) {
  std::copy_n(q, plan_.nv, q_);
  std::copy_n(qd, plan_.nv, qd_);
  std::copy_n(qdd, plan_.nv, now_);
  current_ = 0;
  if (!reactions_) return;
  set_joint_wrenches(plan_, workspace_, q, qd, qdd, ports, lambda, qdd_);
  for (int i = 0; i < plan_.nv; ++i) reactions_[i] = workspace_.joints[i].p;
  for (const RotorPlan& rotor : plan_.rotors) {
    const JointState<Scalar>& child = workspace_.joints[rotor.joint];
    reactions_[rotor.joint].moment -= moment_of_child(rotor, child.omega, child.acceleration.angular);
  }
}

template <class Scalar>
const Scalar& EquationTerms<Scalar>::entry(Term term, int element) {
  if (renew(1u << term)) compute(term);
  return terms_[term][element];
}

// Marks an item as up to date; returns whether it must be computed.
template <class Scalar>
bool EquationTerms<Scalar>::renew(unsigned what) {
  const bool is_current = (current_ & what) != 0;
  current_ |= what;
  return !is_current;
}

template <class Scalar>
void EquationTerms<Scalar>::compute(Term term) {
  current_ &= ~accelerations;
  Scalar* to = terms_[term];
  if (term == mass) return set_mass(to);
  if (term == passive) return set_passive(to);
  std::fill_n(qdd_, plan_.nv, Scalar(0));
  // bias terms refer to v' = 0, not to qdd = 0
  for (std::size_t k = 0; term != gravity && k < plan_.balls.size(); ++k) {
    const int chart = plan_.balls[k];
    accelerate_ball(chart, -rate_bias(angles_at(q_ + chart), Vec3<Scalar>(qd_ + chart + 1)));
  }
  set_inertial(term == coriolis ? Vec3<Scalar>(Vec3<Scalar>::Zero()) : plan_.gravity,
               term == gravity ? rest_ : qd_, to);
}

// Column by column (M is symmetric): the forces for a unit acceleration.
template <class Scalar>
void EquationTerms<Scalar>::set_mass(Scalar* M) {
  for (int k = 0; k < velocities(); ++k, M += velocities()) {
    const auto [joint, chart] = velocity_at(k);
    std::fill_n(qdd_, plan_.nv, Scalar(0));
    if (chart != ground)
      accelerate_ball(chart, Vec3<Scalar>::Unit(joint - chart - 1));
    else
      qdd_[joint] = Scalar(1);
    set_inertial(Vec3<Scalar>::Zero(), rest_, M);
    M[k] += plan_.joints[joint].armature;
  }
}

template <class Scalar>
void EquationTerms<Scalar>::set_passive(Scalar* forces) {
  set_positions(plan_, workspace_, q_);
  for (auto& joint : workspace_.joints) joint.p = Force<Scalar>::zero();
  add_forces_between_bodies(plan_, workspace_, q_, qd_);
  collect(forces);
  for (int i = 0; i < plan_.nv; ++i) {
    if (is_chart(i)) continue;
    *forces = joint_force(plan_, i, q_[i], qd_[i], Scalar(-*forces));
    ++forces;
  }
}

template <class Scalar>
void EquationTerms<Scalar>::set_inertial(const Vec3<Scalar>& weight, const Scalar* qd, Scalar* forces) {
  set_body_wrenches(plan_, workspace_, q_, qd, qdd_, weight);
  collect(forces);
}

// Sets the accelerations of the joints z, x, y for `alpha` (link axes), the angular acceleration without
// velocity products.
template <class Scalar>
void EquationTerms<Scalar>::accelerate_ball(int chart, const Vec3<Scalar>& alpha) {
  const Vec3<Scalar> rates = angle_rates(angles_at(q_ + chart), alpha);
  std::copy_n(rates.data(), 3, qdd_ + chart + 1);
}

// Leaves to root: generalized forces along the velocities, from the wrenches of the bodies.
template <class Scalar>
void EquationTerms<Scalar>::collect(Scalar* forces) {
  for (int i = plan_.nv; i-- > 0;) {
    const JointPlan<Scalar>& joint = plan_.joints[i];
    if (joint.parent == ground) continue;
    Force<Scalar> p = workspace_.joints[i].p;
    to_parent(joint, workspace_.joints[i], p);
    add(workspace_.joints[joint.parent].p, p);
  }
  for (int i = 0; i < plan_.nv; ++i)
    if (is_chart(i)) {
      const Vec3<Scalar> moment = in_link_axes(workspace_.joints[i += 3].p.moment);
      forces = std::copy_n(moment.data(), 3, forces);
    } else {
      *forces++ = generalized_force(plan_.joints[i], workspace_.joints[i].p);
    }
}

template <class Scalar>
typename EquationTerms<Scalar>::Velocity EquationTerms<Scalar>::velocity_at(int k) const {
  int last = ground;
  for (int chart : plan_.balls)
    if (chart <= k) {
      ++k;
      last = chart;
    }
  return {k, plan_.joints[k].of_ball ? last : ground};
}

template <class Scalar>
void EquationTerms<Scalar>::set_bodies() {
  set_positions(plan_, workspace_, q_);
  for (int i = 0; i < plan_.nv; ++i) {
    const JointPlan<Scalar>& joint = plan_.joints[i];
    bodies_[i] = moved(joint, workspace_.joints[i],
                       joint.parent == ground ? ground_at_rest<Scalar>() : bodies_[joint.parent], qd_[i]);
  }
}

template <class Scalar>
Scalar EquationTerms<Scalar>::jacobian(int body, const Vec3<double>& point, int element, bool rate) {
  const auto [joint, chart] = velocity_at(element % velocities());
  int ancestor = body;
  while (ancestor > joint) ancestor = plan_.joints[ancestor].parent;
  if (ancestor != joint) return Scalar(0);
  if (renew(bodies)) set_bodies();
  // the z axis of a joint, or a link axis of a spherical joint; with `rate` its time derivative
  const JointPlan<Scalar>& plan = plan_.joints[joint];
  const GroundState<Scalar>& on = bodies_[chart == ground ? joint : chart + 3];
  const Vec3<Scalar> z = on.rotation.col(chart == ground ? 2 : (joint - chart) % 3);
  const Vec3<Scalar> axis = rate ? Vec3<Scalar>(on.omega.cross(z)) : z;
  const int row = element / velocities();
  if (row < 3) return turns(plan) ? axis[row] : Scalar(0);
  Vec3<Scalar> column = Scalar(advance(plan)) * axis;
  if (turns(plan)) {
    const PointMotion<Scalar> at = point_motion(bodies_[body], Vec3<Scalar>(point.cast<Scalar>()));
    column += axis.cross(at.position - on.position);
    if (rate) column += z.cross(at.velocity - on.velocity);
  }
  return column[row - 3];
}

// M = L L^T. Rows of prescribed joints are zero: no force moves these joints.
template <class Scalar>
void EquationTerms<Scalar>::factor_mass() {
  using std::sqrt;
  const int n = velocities();
  if (renew(1u << mass)) compute(mass);
  const Scalar* M = terms_[mass];
  for (int i = 0; i < n; ++i) {
    const bool held = plan_.joints[velocity_at(i).joint].prescribed;
    for (int j = 0; j <= i; ++j) {
      Scalar sum = M[i * n + j];
      for (int k = 0; k < j; ++k) sum -= factor_[i * n + k] * factor_[j * n + k];
      Scalar& entry = factor_[i * n + j];
      if (held || (j < i && factor_[j * n + j] == Scalar(0)))
        entry = Scalar(0);
      else
        entry = i == j ? Scalar(sqrt(sum)) : Scalar(sum / factor_[j * n + j]);
    }
  }
}

// x = L^-1 times one row of the Jacobian.
template <class Scalar>
void EquationTerms<Scalar>::solve_lower(int body, const Vec3<double>& point, int row, Scalar* x) {
  const int n = velocities();
  for (int i = 0; i < n; ++i) {
    const Scalar& pivot = factor_[i * n + i];
    x[i] = Scalar(0);
    if (pivot == Scalar(0)) continue;
    Scalar sum = jacobian(body, point, row * n + i, false);
    for (int k = 0; k < i; ++k) sum -= factor_[i * n + k] * x[k];
    x[i] = sum / pivot;
  }
}

template <class Scalar>
Scalar EquationTerms<Scalar>::inverse_inertia(int body, const Vec3<double>& point, int element) {
  if (renew(factors)) factor_mass();
  const int n = velocities();
  Scalar *a = factor_ + n * n, *b = a + n, sum(0);
  solve_lower(body, point, element / 6, a);
  solve_lower(body, point, element % 6, b);
  for (int k = 0; k < n; ++k) sum += a[k] * b[k];
  return sum;
}

template <class Scalar>
Scalar EquationTerms<Scalar>::along(int velocity, int body, int root, Force<Scalar> wrench) const {
  const auto [joint, chart] = velocity_at(velocity);
  const int moved = chart == ground ? joint : chart + 3;
  for (; body > moved && body != root; body = plan_.joints[body].parent)
    to_parent(plan_.joints[body], workspace_.joints[body], wrench);
  if (body != moved || body == root) return Scalar(0);
  return chart == ground ? generalized_force(plan_.joints[joint], wrench)
                         : in_link_axes(wrench.moment)[joint - chart - 1];
}

template <class Scalar>
Scalar EquationTerms<Scalar>::regressor(int link, int element) {
  if (renew(accelerations)) set_body_wrenches(plan_, workspace_, q_, qd_, now_, plan_.gravity);
  const int body = plan_.carrier[link], parameter = element % 10;
  const Mat3<Scalar> R = plan_.frame_in_carrier[link].rotation.template cast<Scalar>();
  const Vec3<Scalar> p = plan_.frame_in_carrier[link].position.template cast<Scalar>();
  const JointState<Scalar>& s = workspace_.joints[body];
  const Vec3<Scalar> carried =
      s.acceleration.linear + s.acceleration.angular.cross(p) + s.omega.cross(Vec3<Scalar>(s.omega.cross(p)));
  using Part = Scalar Symmetric3<Scalar>::*;
  constexpr Part parts[] = {&Symmetric3<Scalar>::xx, &Symmetric3<Scalar>::yy, &Symmetric3<Scalar>::zz,
                            &Symmetric3<Scalar>::xy, &Symmetric3<Scalar>::xz, &Symmetric3<Scalar>::yz};
  RigidInertia<Scalar> unit;
  (parameter == 0  ? unit.mass
   : parameter < 4 ? unit.h[parameter - 1]
                   : unit.inertia.*parts[parameter - 4]) = Scalar(1);
  Force<Scalar> wrench = body_bias(unit, Vec3<Scalar>(R.transpose() * s.omega));
  add(wrench, unit * Motion<Scalar>{R.transpose() * s.acceleration.angular, R.transpose() * carried});
  const Vec3<Scalar> force = R * wrench.force;
  return along(element / 10, body, ground, {R * wrench.moment + p.cross(force), force});
}

template <class Scalar>
Scalar EquationTerms<Scalar>::constraint_jacobian(int loop, int row, int velocity) {
  if (renew(rows)) {
    set_positions(plan_, workspace_, q_);
    set_ground_motion(plan_, workspace_, qd_);
    set_loop_rows(plan_, workspace_);
  }
  const LoopPlan<Scalar>& of = plan_.loops[loop];
  return along(velocity, of.body_a, of.root, workspace_.loop.wrench[0][row]) +
         along(velocity, of.body_b, of.root, workspace_.loop.wrench[1][row]);
}

template <class Scalar>
Force<Scalar> EquationTerms<Scalar>::reaction(int joint) const {
  if (!is_chart(joint)) return reactions_[joint];
  const Force<Scalar>& on_body = reactions_[joint + 3];
  return {in_link_axes(on_body.moment), in_link_axes(on_body.force)};
}

template class EquationTerms<double>;
template class EquationTerms<Dual>;

}  // namespace redysim
