// many_threads MODEL.toml...: eight threads, one instance of the FMU each, all at once and through the
// library's own C boundary. All must find the same bits. Built with the thread sanitizer, nothing may race
// (scripts/sanitize.sh).

#include <cmath>
#include <thread>

#include "scene.hpp"

namespace {

using namespace redysim::process;

constexpr int threads = 8, steps = 40;
constexpr double step_size = 1e-3;

// Steps with changing inputs, goes back to the middle once, and asks for derivatives.
std::vector<double> run(const Scene& scene, const char* method) {
  const Slave slave(scene, {be_silent, nullptr, nullptr, nullptr, nullptr}, method);
  fmi2FMUstate middle = nullptr;
  const auto half = [&](int first) {
    for (int k = first; k < first + steps / 2; ++k) slave.step(k, step_size, 1e-3 * std::sin(k));
  };
  half(0);
  slave.good(fmi2GetFMUstate(slave, &middle));
  half(steps / 2);
  slave.good(fmi2SetFMUstate(slave, middle));
  slave.good(fmi2FreeFMUstate(slave, &middle));
  half(steps / 2);
  std::vector<double> found = slave.outputs();
  for (double derivative : slave.derivatives()) found.push_back(derivative);
  return found;
}

void compare(const Scene& scene, const char* method) {
  std::vector<std::vector<double>> found(threads);
  std::vector<std::thread> at_work;
  for (int i = 0; i < threads; ++i) at_work.emplace_back([&, i] { found[i] = run(scene, method); });
  for (std::thread& thread : at_work) thread.join();
  const std::vector<double> alone = run(scene, method);
  for (const std::vector<double>& one : found)
    if (one != alone) fail(scene.name + ", " + method + ": a thread found other results");
}

}  // namespace

int main(int count, char** models) {
  for (int i = 1; i < count; ++i) {
    const Scene scene(models[i]);
    for (const char* method : methods) compare(scene, method);
    std::printf("%s: %d threads agree with every method\n", scene.name.c_str(), threads);
  }
  return 0;
}
