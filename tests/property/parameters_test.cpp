#include <gtest/gtest.h>

#include "support/evaluate.hpp"
#include "support/random_tree.hpp"

// The plan from parameters in dual numbers.

namespace redysim {
namespace {

using test::derivative;
using test::dual;
using test::Evaluate;
using test::Vector;

// Those that the accelerations depend on smoothly.
template <class Scalar>
std::vector<Scalar*> numbers_of(Parameters<Scalar>& parameters) {
  std::vector<Scalar*> numbers;
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(&parameters.gravity[axis]);
  for (LinkParameters<Scalar>& link : parameters.links) {
    numbers.push_back(&link.mass);
    for (int axis = 0; axis < 3; ++axis) numbers.push_back(&link.com[axis]);
    for (Scalar& entry : link.inertia) numbers.push_back(&entry);
  }
  for (JointParameters<Scalar>& joint : parameters.joints) {
    for (Scalar* number :
         {&joint.damping, &joint.stiffness, &joint.rest, &joint.armature, &joint.friction_velocity,
          &joint.stop_stiffness, &joint.stop_damping, &joint.stop_width})
      numbers.push_back(number);
    if (joint.friction != joint.static_friction)  // no kink at equal values
      for (Scalar* number : {&joint.friction, &joint.static_friction}) numbers.push_back(number);
    if (has_stops(joint))
      for (Scalar* number : {&joint.lower, &joint.upper}) numbers.push_back(number);
  }
  return numbers;
}

class TreeParameters : public testing::TestWithParam<unsigned> {};

INSTANTIATE_TEST_SUITE_P(Seed, TreeParameters, testing::Range(0u, 20u));

TEST_P(TreeParameters, derivatives_are_those_of_the_plan) {
  test::Random random(GetParam());
  const Model model = test::random_tree(random, test::options_of(GetParam()));
  Evaluate<double> tree(model);
  Evaluate<Dual> along(model);
  const auto numbers = [&] { return test::vector_of(random.numbers(tree.nv(), 2)); };
  const Vector q = numbers(), qd = numbers(), tau = numbers(), none = Vector::Zero(tree.nv());
  const Vector qdd = tree.qdd(q, qd, tau);
  const test::Matrix M = tree.inertia(q);
  Parameters<double> values = parameters_of(model);
  Parameters<Dual> duals = values.cast<Dual>();
  const std::vector<double*> places = numbers_of(values);
  const std::vector<Dual*> directions = numbers_of(duals);
  for (std::size_t k = 0; k < places.size(); ++k) {
    directions[k]->derivative = 1;
    along.plan.update(duals);
    directions[k]->derivative = 0;
    const Vector found = derivative(along.tau(dual(q, none), dual(qd, none), dual(qdd, none)));
    const Vector moved = derivative(along.qdd(dual(q, none), dual(qd, none), dual(tau, none)));

    const double value = *places[k], h = 1e-6;
    const auto tau_at = [&](double changed) {
      *places[k] = changed;
      tree.plan.update(values);
      return tree.tau(q, qd, qdd);
    };
    const Vector difference = (tau_at(value + h) - tau_at(value - h)) / (2 * h);
    *places[k] = value;
    const double scale = std::max(1.0, difference.lpNorm<Eigen::Infinity>());
    EXPECT_LT((found - difference).lpNorm<Eigen::Infinity>() / scale, 1e-5) << k;
    // M qdd + bias = tau at every value of the parameter
    EXPECT_LT((M * moved + found).lpNorm<Eigen::Infinity>() / scale, 1e-9) << k;
  }
}

}  // namespace
}  // namespace redysim
