#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "dynamics/compiled.hpp"
#include "dynamics/straight_line/straight_line.hpp"
#include "straight_line_scenes.hpp"

// One evaluation of forward dynamics by the recursion and as straight-line code, names `scene/metric`;
// `operations` of the latter and the `longest` that is used. bench/straight_line.py computes the ratios of
// one run.

namespace redysim {
// the names are defined by CMake
#define REDYSIM_LINE(scene) \
  bool line_of_##scene(const Plan<double>&, const double*, const double*, const double*, double*, double*);
REDYSIM_LINES
#undef REDYSIM_LINE
}  // namespace redysim

namespace {

using namespace redysim;

struct Scene {
  explicit Scene(const Model& model)
      : plan(model),
        ws(plan),
        line(straight_line(model)),
        q(static_cast<std::size_t>(plan.nv)),
        qd(q),
        tau(q),
        out(q),
        drive(q) {
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i] = plan.has_constraints() ? model.links[plan.joints[i].link].joint.q0
                                    : std::sin(1.7 * static_cast<double>(i) + 0.3);
      qd[i] = std::cos(2.3 * static_cast<double>(i));
      tau[i] = std::sin(0.9 * static_cast<double>(i));
    }
  }
  Plan<double> plan;
  Workspace<double> ws;
  StraightLine line;
  std::vector<double> q, qd, tau, out, drive;
};

template <class Evaluate>
void measure(const std::string& name, const std::shared_ptr<Scene>& scene, Evaluate&& evaluate) {
  benchmark::RegisterBenchmark(name.c_str(), [scene, evaluate](benchmark::State& state) {
    for (auto _ : state) {
      evaluate(*scene);
      benchmark::DoNotOptimize(scene->out.data());
      benchmark::ClobberMemory();
    }
    state.counters["operations"] = operations(scene->line);
    state.counters["longest"] = longest_line(scene->line);
  });
}

template <class Line>
void measure_scene(const std::string& name, Line line) {
  const Model model = bench::straight_line_scene(name);
  const auto scene = std::make_shared<Scene>(model);
  measure(name + "/recursion", scene, [](Scene& s) {
    compiled_forward_dynamics(s.plan, s.ws, s.q.data(), s.qd.data(), s.tau.data(), s.out.data());
  });
  measure(name + "/straight_line", scene, [line](Scene& s) {
    return line(s.plan, s.q.data(), s.qd.data(), s.tau.data(), s.out.data(), s.drive.data());
  });
}

}  // namespace

int main(int argc, char** argv) {
#define REDYSIM_LINE(scene) measure_scene(#scene, &line_of_##scene);
  REDYSIM_LINES
#undef REDYSIM_LINE
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
