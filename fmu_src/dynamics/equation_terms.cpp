#include "dynamics/equation_terms.hpp"

#include <algorithm>

#include "dynamics/ball.hpp"
#include "dynamics/rnea.hpp"

namespace redysim {
namespace {

constexpr OutputGroup groups[] = {OutputGroup::gravity_torque, OutputGroup::coriolis, OutputGroup::bias,
                                  OutputGroup::passive, OutputGroup::mass_matrix};

template <class Scalar>
BallAnglesOf<Scalar> angles_at(const Scalar* chart) {
  return {false, chart[1], chart[2], chart[3]};
}

}  // namespace

template <class Scalar>
bool EquationTerms<Scalar>::needed(const Model& model) {
  return std::any_of(std::begin(groups), std::end(groups),
                     [&model](OutputGroup group) { return model.fmu.shows(group); });
}

template <class Scalar>
EquationTerms<Scalar>::EquationTerms(const Model& model, const Plan<Scalar>& plan)
    : plan_(plan), workspace_(plan), q_(plan.joints.size()), qd_(q_), qdd_(q_), rest_(q_) {
  std::size_t ball = 0;
  for (int i = 0; i < plan.nv; ++i) {
    if (!plan.joints[i].of_ball) {
      velocities_.push_back({i, -1});
      continue;
    }
    const int part = i - plan.balls[ball] - 1;
    if (part >= 0) velocities_.push_back({i, part});
    if (part == 2) ++ball;
  }
  const std::size_t n = velocities_.size();
  for (int term = 0; term < count; ++term)
    if (model.fmu.shows(groups[term])) terms_[term].resize(term == mass ? n * n : n);
}

template <class Scalar>
void EquationTerms<Scalar>::go_to(const Scalar* q, const Scalar* qd) {
  std::copy_n(q, q_.size(), q_.begin());
  std::copy_n(qd, qd_.size(), qd_.begin());
  current_ = 0;
}

template <class Scalar>
const Scalar& EquationTerms<Scalar>::entry(Term term, int element) {
  if ((current_ >> term & 1) == 0) compute(term);
  return terms_[term][static_cast<std::size_t>(element)];
}

template <class Scalar>
void EquationTerms<Scalar>::compute(Term term) {
  current_ |= 1u << term;
  Scalar* to = terms_[term].data();
  const Vec3<Scalar> weightless = Vec3<Scalar>::Zero();
  std::fill(qdd_.begin(), qdd_.end(), Scalar(0));
  switch (term) {
    case mass:
      return set_mass(to);
    case passive:
      return set_passive(to);
    case gravity:
      return set_inertial(plan_.gravity, rest_.data(), to);
    default:
      break;
  }
  // v' = 0
  for (int chart : plan_.balls)
    accelerate_ball(chart, -rate_bias(angles_at(&q_[chart]), Vec3<Scalar>(&qd_[chart + 1])));
  set_inertial(term == bias ? plan_.gravity : weightless, qd_.data(), to);
}

// By columns: forces of a unit acceleration.
template <class Scalar>
void EquationTerms<Scalar>::set_mass(Scalar* M) {
  for (int k = 0; k < size(); ++k, M += size()) {
    const auto [joint, part] = velocities_[k];
    std::fill(qdd_.begin(), qdd_.end(), Scalar(0));
    if (part < 0)
      qdd_[joint] = Scalar(1);
    else
      accelerate_ball(joint - 1 - part, Vec3<Scalar>::Unit(part));
    set_inertial(Vec3<Scalar>::Zero(), rest_.data(), M);
    M[k] += plan_.joints[joint].armature;
  }
}

template <class Scalar>
void EquationTerms<Scalar>::set_inertial(const Vec3<Scalar>& weight, const Scalar* qd, Scalar* forces) {
  set_body_wrenches(plan_, workspace_, q_.data(), qd, qdd_.data(), weight);
  collect(forces);
}

template <class Scalar>
void EquationTerms<Scalar>::set_passive(Scalar* forces) {
  set_positions(plan_, workspace_, q_.data());
  for (auto& joint : workspace_.joints) joint.p = Force<Scalar>::zero();
  add_forces_between_bodies(plan_, workspace_, q_.data(), qd_.data());
  collect(forces);
  for (const auto& [joint, part] : velocities_) {
    *forces = -*forces;
    if (part < 0) *forces += joint_force(plan_, joint, q_[joint], qd_[joint], Scalar(0));
    ++forces;
  }
}

// Accelerations of the joints z, x, y for the part of alpha (link axes) besides velocity products.
template <class Scalar>
void EquationTerms<Scalar>::accelerate_ball(int chart, const Vec3<Scalar>& alpha) {
  const Vec3<Scalar> rates = angle_rates(angles_at(&q_[chart]), alpha);
  std::copy_n(rates.data(), 3, &qdd_[chart + 1]);
}

// Leaves to root: forces along the velocities for the wrenches of the bodies.
template <class Scalar>
void EquationTerms<Scalar>::collect(Scalar* forces) {
  for (int i = plan_.nv; i-- > 0;) {
    const JointPlan<Scalar>& joint = plan_.joints[i];
    if (joint.parent == ground) continue;
    Force<Scalar> p = workspace_.joints[i].p;
    to_parent(joint, workspace_.joints[i], p);
    add(workspace_.joints[joint.parent].p, p);
  }
  for (const auto& [joint, part] : velocities_)
    // link axes x, y, z are y, z, x of the last joint's body
    *forces++ = part < 0 ? generalized_force(plan_.joints[joint], workspace_.joints[joint].p)
                         : workspace_.joints[joint + 2 - part].p.moment[(part + 1) % 3];
}

template class EquationTerms<double>;
template class EquationTerms<Dual>;

}  // namespace redysim
