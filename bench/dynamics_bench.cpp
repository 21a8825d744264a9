#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "dynamics/compiled.hpp"
#include "integrate/system/system.hpp"
#include "model/read/model_file.hpp"
#include "support/mechanisms.hpp"
#ifdef REDYSIM_WITH_PINOCCHIO
#include "pinocchio_model.hpp"
#endif

// Cost of one call of the recursions and of the right-hand side, names `scene/metric`. The state is the same
// in each call, because no code branches on it. bench/run.py computes the ratios of one run.

namespace {

using namespace redysim;

// A scene with a fixed state and static lifetime.
struct Scene {
  std::string name;
  Model model;
  Plan<double> plan;
  Workspace<double> ws;
  std::vector<double> q, qd, tau, out;

  Scene(std::string scene_name, Model scene_model, std::vector<double> pose = {})
      : name(std::move(scene_name)),
        model(std::move(scene_model)),
        plan(model),
        ws(plan),
        q(std::move(pose)) {
    const std::size_t n = static_cast<std::size_t>(plan.nv);
    const bool given = !q.empty();
    q.resize(n);
    qd.resize(n);
    tau.resize(n);
    out.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      if (!given) q[i] = std::sin(1.7 * static_cast<double>(i) + 0.3);
      qd[i] = given ? 0 : std::cos(2.3 * static_cast<double>(i));
      tau[i] = std::sin(0.9 * static_cast<double>(i));
    }
  }
};

void measure_open_tree(const std::shared_ptr<Scene>& s) {
  benchmark::RegisterBenchmark((s->name + "/forward_dynamics").c_str(), [s](benchmark::State& state) {
    for (auto _ : state) {
      compiled_forward_dynamics(s->plan, s->ws, s->q.data(), s->qd.data(), s->tau.data(), s->out.data());
      benchmark::DoNotOptimize(s->out.data());
      benchmark::ClobberMemory();
    }
  });
  benchmark::RegisterBenchmark((s->name + "/inverse_dynamics").c_str(), [s](benchmark::State& state) {
    for (auto _ : state) {
      compiled_inverse_dynamics(s->plan, s->ws, s->q.data(), s->qd.data(), s->tau.data(), s->out.data());
      benchmark::DoNotOptimize(s->out.data());
      benchmark::ClobberMemory();
    }
  });
#ifdef REDYSIM_WITH_PINOCCHIO
  // Pinocchio's data contain three-dimensional arrays of nv: 1000 joints would need tens of gigabytes
  if (s->plan.nv > 200) return;
  const auto peer = std::make_shared<bench::PinocchioTree>(s->model);
  // a comparison requires equal accelerations
  compiled_forward_dynamics(s->plan, s->ws, s->q.data(), s->qd.data(), s->tau.data(), s->out.data());
  const double* other = peer->forward_dynamics(s->q.data(), s->qd.data(), s->tau.data(), false);
  double largest = 0, difference = 0;
  for (int i = 0; i < s->plan.nv; ++i) {
    largest = std::max(largest, std::abs(other[i]));
    difference = std::max(difference, std::abs(other[i] - s->out[i]));
  }
  if (!(difference <= 1e-6 * largest)) {
    std::fprintf(stderr, "%s: accelerations differ from Pinocchio's by %g of %g\n", s->name.c_str(),
                 difference, largest);
    std::exit(1);
  }
  for (const bool world : {false, true})
    benchmark::RegisterBenchmark(
        (s->name + "/pinocchio_aba_" + (world ? "world" : "local")).c_str(),
        [s, peer, world](benchmark::State& state) {
          for (auto _ : state) {
            benchmark::DoNotOptimize(peer->forward_dynamics(s->q.data(), s->qd.data(), s->tau.data(), world));
            benchmark::ClobberMemory();
          }
        });
  benchmark::RegisterBenchmark((s->name + "/pinocchio_rnea").c_str(), [s, peer](benchmark::State& state) {
    for (auto _ : state) {
      benchmark::DoNotOptimize(peer->inverse_dynamics(s->q.data(), s->qd.data(), s->tau.data()));
      benchmark::ClobberMemory();
    }
  });
#endif
}

void measure_right_hand_side(const std::shared_ptr<Scene>& s) {
  const auto system = std::make_shared<System>(s->plan, true);
  benchmark::RegisterBenchmark((s->name + "/right_hand_side").c_str(), [s, system](benchmark::State& state) {
    std::vector<double> y(s->q), ydot(static_cast<std::size_t>(system->size()));
    y.insert(y.end(), s->qd.begin(), s->qd.end());
    y.push_back(0);
    for (auto _ : state) {
      benchmark::DoNotOptimize(system->right_hand_side(0, y.data(), ydot.data()));
      benchmark::ClobberMemory();
    }
  });
}

Model model_file(const std::string& name) {
  return read_model_file(std::string(REDYSIM_MODELS "/") + name + ".toml").model;
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::AddCustomContext("flags", REDYSIM_BENCH_FLAGS);
  benchmark::AddCustomContext("compiler", "g++ " __VERSION__);
#ifdef REDYSIM_WITH_PINOCCHIO
  benchmark::AddCustomContext("pinocchio", bench::PinocchioTree::version());
#endif
  measure_open_tree(std::make_shared<Scene>("kuka_kr5", model_file("kuka_kr5")));
  for (const bool right_angles : {true, false})
    for (const int n : {1, 2, 6, 7, 10, 30, 100, 1000})
      measure_open_tree(std::make_shared<Scene>(
          (right_angles ? "right_angle_chain_" : "any_angle_chain_") + std::to_string(n),
          test::serial_chain(n, right_angles)));
  measure_right_hand_side(std::make_shared<Scene>("kuka_kr5", model_file("kuka_kr5")));
  // additional cost of friction and stops in every joint
  Model resisted = model_file("kuka_kr5");
  for (Link& link : resisted.links) {
    link.joint.friction = 1;
    link.joint.static_friction = 1.5;
    link.joint.lower = -2;
    link.joint.upper = 0.5;
    link.joint.stop_stiffness = 1e4;
    link.joint.stop_damping = 0.2;
  }
  measure_right_hand_side(std::make_shared<Scene>("kuka_kr5_friction_and_stops", resisted));
  measure_right_hand_side(std::make_shared<Scene>(
      "four_bar", model_file("four_bar"), std::vector<double>{0, 2.278380763520252, 2.278380763520252}));
  for (const int n : {1, 10, 100}) {
    const auto angle = [](int k) { return 1.2 + 0.1 * std::sin(7.0 * k); };
    measure_right_hand_side(std::make_shared<Scene>(
        "four_bar_chain_" + std::to_string(n), test::four_bar_chain(n), test::four_bar_chain_pose(n, angle)));
    measure_right_hand_side(std::make_shared<Scene>("overlapping_loops_" + std::to_string(n),
                                                    test::overlapping_loops(n),
                                                    test::overlapping_loops_pose(n)));
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
