#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "model/number.hpp"
#include "support/allocation_count.hpp"
#include "unit/integrate/rig.hpp"

// Runs of controlled models: closed forms, an external controller, borders of trajectories, restored states.

namespace redysim {
namespace {

using test::solver;

// A file of models/ with more text after it, and one integrator at its start pose.
struct Simulation {
  Model model;
  Plan<double> plan;
  System system;
  std::unique_ptr<Integrator> integrator;

  Simulation(const std::string& name, const std::string& more, SolverMethod method, double rtol,
             bool with_work = false)
      : Simulation(read_model_text(text_of(name) + "\n" + more, REDYSIM_MODELS "/" + name).model,
                   solver(method, rtol), with_work) {}
  Simulation(Model given, const SolverSettings& settings, bool with_work)
      : model(std::move(given)),
        plan(model),
        system(plan, with_work, &model),
        integrator(make_integrator(system, settings)) {
    std::vector<double> y(static_cast<std::size_t>(system.size()), 0.0);
    for (int k = 0; k < system.simple(); ++k) {
      y[k] = model.links[plan.joints[system.joint_of(k)].link].joint.q0;
      y[system.layout().qd[k]] = model.links[plan.joints[system.joint_of(k)].link].joint.qd0;
    }
    integrator->start(0, y.data());
  }
  static std::string text_of(const std::string& name) {
    return read_model_file(std::string(REDYSIM_MODELS "/") + name + ".toml").source;
  }
  void to(double end) {
    const Outcome outcome = advance(*integrator, system, end, false);
    ASSERT_TRUE(outcome.ok) << outcome.message;
  }
  double q(int k) const { return integrator->state()[k]; }
  double qd(int k) const { return integrator->state()[system.layout().qd[k]]; }
};

std::string cycloids(int joints, double to, double duration) {
  std::string text;
  for (int i = 1; i <= joints; ++i)
    text += "[[trajectory]]\njoint = 'joint" + std::to_string(i) +
            "'\ntype = 'cycloid'\nfrom = 0\nto = " + std::to_string(to) +
            "\nduration = " + std::to_string(duration) + "\n";
  return text;
}

std::string controller(const std::string& law, double kp, double kd) {
  return "[controller]\nlaw = '" + law + "'\nkp = " + std::to_string(kp) + "\nkd = " + std::to_string(kd) +
         "\n";
}

class Controlled : public testing::TestWithParam<SolverMethod> {};

INSTANTIATE_TEST_SUITE_P(Methods, Controlled,
                         testing::Values(SolverMethod::erk, SolverMethod::adams, SolverMethod::bdf));

TEST_P(Controlled, computed_torque_errors_decay_as_in_closed_form) {
  Simulation run("kuka_kr5", cycloids(6, 60, 1) + controller("computed_torque", 49, 14), GetParam(), 1e-9);
  // beside the trajectory and at another speed
  std::vector<double> y(run.integrator->state(), run.integrator->state() + run.system.size());
  for (int k = 0; k < 6; ++k) {
    y[k] = 0.1 + 0.02 * k;
    y[6 + k] = -0.3 * k;
  }
  run.integrator->start(0, y.data());
  for (double t : {0.25, 0.8, 1.0, 1.6}) {
    run.to(t);
    for (int k = 0; k < 6; ++k) {
      const JointMotion wanted =
          motion_at(run.model.trajectories[k], phase_at(run.model.trajectories[k], t), t);
      // e'' + 14 e' + 49 e = 0: critically damped
      const double e0 = -(0.1 + 0.02 * k), rate = 0.3 * k;
      const double e = (e0 + (rate + 7 * e0) * t) * std::exp(-7 * t);
      EXPECT_NEAR(wanted.q - run.q(k), e, 2e-7) << "joint " << k << " at " << t;
    }
  }
}

TEST_P(Controlled, pd_is_what_an_external_controller_tends_to) {
  const std::string references = cycloids(2, 0.7, 0.5);
  Simulation inside("planar_2r", references + controller("pd", 20, 3), GetParam(), 1e-9);
  inside.to(0.7);
  double before = 0;
  for (int steps : {700, 1400, 2800}) {
    Simulation outside("planar_2r", references, GetParam(), 1e-9);
    for (int n = 0; n < steps; ++n) {
      const double t = 0.7 * n / steps;
      for (int k = 0; k < 2; ++k) {
        const Trajectory& own = inside.model.trajectories[k];
        const JointMotion wanted = motion_at(own, phase_at(own, t), t);
        outside.system.tau(k) = 20 * (wanted.q - outside.q(k)) + 3 * (wanted.qd - outside.qd(k));
      }
      ASSERT_TRUE(outside.integrator->advance(0.7 * (n + 1) / steps, true).ok);
    }
    const double error = std::max(std::abs(inside.q(0) - outside.q(0)), std::abs(inside.q(1) - outside.q(1)));
    // a held torque lags by half a step: first order
    if (before > 0) {
      EXPECT_NEAR(before / error, 2, 0.2);
    }
    EXPECT_LT(error, 5e-3);
    before = error;
  }
  EXPECT_LT(before, 2e-4);
}

TEST_P(Controlled, the_end_of_a_trajectory_is_the_end_of_a_step) {
  // the acceleration of a cubic jumps at its ends, here between the points of communication
  const std::string cubic =
      "[[trajectory]]\njoint = 'joint1'\ntype = 'cubic'\nto = 1.7\nstart = 0.123\nduration = 0.3\n";
  Simulation coarse("planar_2r", cubic + controller("computed_torque", 49, 14), GetParam(), 1e-6, true);
  Simulation fine("planar_2r", cubic + controller("computed_torque", 49, 14), SolverMethod::erk, 1e-11, true);
  coarse.to(0.6);
  for (double t : {0.123, 0.2, 0.423, 0.6}) fine.to(t);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(coarse.integrator->state()[k], fine.integrator->state()[k], 1e-5);
  // the reference is met exactly all along, for the arm starts on it
  EXPECT_NEAR(coarse.q(0), 1.7, 1e-5);
}

// A joint that accelerates with 8 rad/s^2 and, from `turn` on, brakes with 4.
std::string jump_at(double turn) {
  const auto row = [](double a, double b, double c, double d) {
    std::string text;
    for (double value : {a, b, c, d}) text += (text.empty() ? "[" : ", ") + shown(value);
    return text + "]\n";
  };
  const double v = 8 * turn, q = 4 * turn * turn, rest = 0.3;
  return "[[trajectory]]\njoint = 'joint1'\ntype = 'table'\ntime = " + row(0, turn, turn, turn + rest) +
         "q = " + row(0, q, q, q + v * rest - 2 * rest * rest) + "qd = " + row(0, v, v, v - 4 * rest) +
         "qdd = " + row(8, 8, -4, -4);
}

TEST_P(Controlled, a_jump_of_the_acceleration_is_the_end_of_a_step) {
  const double turn = 0.1234;
  for (const int steps : {1, 150}) {
    Simulation run("planar_2r", jump_at(turn) + controller("computed_torque", 49, 14), GetParam(), 1e-6);
    for (int k = 1; k <= steps; ++k) run.to(0.3 * k / steps);
    // the arm starts on the reference, where the law leaves no error
    const double since = 0.3 - turn;
    EXPECT_NEAR(run.q(0), 4 * turn * turn + 8 * turn * since - 2 * since * since, 2e-6);
    EXPECT_NEAR(run.qd(0), 8 * turn - 4 * since, 2e-5);
  }
}

// A step serves many communication points, but ends at each sample.
TEST(control, steps_pass_communication_points_up_to_a_sample) {
  const std::string text = cycloids(2, 0.7, 0.25) + controller("pd", 5, 0.1);
  Simulation continuous("planar_2r", text, SolverMethod::erk, 1e-8),
      sampled("planar_2r", text + "sample_time = 0.01\n", SolverMethod::erk, 1e-8),
      coarse("planar_2r", text + "sample_time = 0.01\n", SolverMethod::adams, 1e-11);
  for (int k = 1; k <= 500; ++k) {
    continuous.to(1e-3 * k);
    sampled.to(1e-3 * k);
  }
  EXPECT_LT(continuous.integrator->statistics().evaluations, 2 * 500);  // 6 each if they ended there
  EXPECT_GT(sampled.integrator->statistics().steps, 50 - 1);
  EXPECT_LT(sampled.integrator->statistics().steps, 200);
  coarse.to(0.5);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(sampled.q(k), coarse.q(k), 1e-8);
}

TEST_P(Controlled, where_it_is_cut_does_not_matter) {
  const std::string text = cycloids(2, 0.7, 0.25) + controller("pd", 20, 3);
  Simulation whole("planar_2r", text, GetParam(), 1e-10), cut("planar_2r", text, GetParam(), 1e-10);
  whole.to(0.5);
  for (int n = 1; n <= 50; ++n) cut.to(0.01 * n);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(whole.q(k), cut.q(k), 1e-8);
}

void expect_restored_runs_to_go_on(const std::string& robot, const std::string& text, SolverMethod method) {
  Simulation whole(robot, text, method, 1e-7, true);
  std::vector<std::vector<unsigned char>> saved;
  std::vector<std::vector<double>> states, inputs;
  const auto state = [](const Simulation& run) {
    return std::vector<double>(run.integrator->state(), run.integrator->state() + run.system.size());
  };
  for (int n = 0; n <= 30; ++n) {
    if (n > 0) whole.to(0.0125 * n);
    saved.emplace_back();
    whole.integrator->save(saved.back());
    states.push_back(state(whole));
    inputs.push_back(whole.system.inputs());
  }
  for (int from : {3, 19, 20, 21, 27}) {
    Simulation again(robot, text, method, 1e-7, true);
    again.system.inputs() = inputs[from];
    ASSERT_TRUE(again.integrator->restore(saved[from].data(), saved[from].size()));
    for (int n = from + 1; n <= 30; ++n) {
      again.to(0.0125 * n);
      EXPECT_EQ(std::memcmp(state(again).data(), states[n].data(), states[n].size() * sizeof(double)), 0)
          << n;
    }
  }
}

TEST_P(Controlled, a_restored_run_goes_on_bit_for_bit) {
  const std::string law = controller("computed_torque", 49, 14);
  expect_restored_runs_to_go_on("kuka_kr5", cycloids(6, 60, 0.25) + law, GetParam());
  // the acceleration jumps at the 20th communication point
  expect_restored_runs_to_go_on("planar_2r", jump_at(0.25) + law, GetParam());
  expect_restored_runs_to_go_on("planar_2r", jump_at(0.25) + law + "sample_time = 0.013\ndelay = 0.03\n",
                                GetParam());
}

TEST_P(Controlled, steps_do_not_allocate) {
  for (const char* sampling : {"", "sample_time = 5e-4\ndelay = 7e-4\n"})
    for (const char* law : {"pd", "gravity_compensation", "feed_forward", "computed_torque"}) {
      Simulation run("planar_2r", cycloids(2, 1, 0.1) + controller(law, 20, 3) + sampling, GetParam(), 1e-6,
                     true);
      run.to(0.01);
      const long before = test::allocations;
      for (int n = 2; n < 20; ++n) run.to(0.01 * n);
      EXPECT_EQ(test::allocations, before) << law << sampling;
    }
}

TEST(control, a_scene_without_one_has_no_trace_of_it) {
  Simulation plain("kuka_kr5", "", SolverMethod::erk, 1e-6);
  EXPECT_EQ(plain.system.control(), nullptr);
  EXPECT_EQ(plain.system.inputs().size(), 6u);
  // and the forces that the recursion takes are the inputs themselves
  EXPECT_EQ(plain.system.recursion_inputs(), plain.system.inputs().data());
}

TEST(control, the_stiff_gripper_is_few_right_hand_sides_for_bdf) {
  const std::string text =
      "[[trajectory]]\njoint = 'joint1'\ntype = 'cycloid'\nto = 60\nduration = 1.5\n"
      "[[trajectory]]\njoint = 'joint2'\ntype = 'cycloid'\nto = 80\nduration = 1.5\n"
      "[[trajectory]]\njoint = 'joint3'\ntype = 'cycloid'\nto = 80\nduration = 1.5\n"
      "[[trajectory]]\njoint = 'joint4'\ntype = 'cycloid'\nto = 120\nduration = 1.5\n" +
      controller("pd", 16, 8);
  Simulation run("gripper_redysim", text, SolverMethod::bdf, 1e-8, true);
  run.to(1.5);
  // an independent program's results; its poles reach -3.1e5 1/s
  const double known[] = {1.027635516, 1.400728587, 1.397885601, 2.096846379};
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(run.q(k), known[k], 1e-8);
  EXPECT_NEAR(-run.system.work(run.integrator->state()), -0.604917816, 1e-8);
  EXPECT_LT(run.integrator->statistics().evaluations, 3000);
}

}  // namespace
}  // namespace redysim
