// No full step without a log allocates: with every method, inputs that are held or set before each step, all
// outputs read.

#include <new>

#include "process/scene.hpp"
#include "support/allocation_count.hpp"

using namespace redysim::process;

namespace {

constexpr int steps = 400;
constexpr double step_size = 1e-3;

// The counter must see each way of asking for memory.
void count_each_allocator() {
  void* blocks[6] = {};
  const long before = redysim::test::allocations;
  blocks[0] = std::malloc(40);
  blocks[1] = std::calloc(5, 8);
  blocks[2] = std::aligned_alloc(64, 128);
  if (posix_memalign(&blocks[3], 64, 100) != 0) fail("posix_memalign failed");
  blocks[4] = ::operator new(40);
  ::operator delete(blocks[4]);
  blocks[5] = ::operator new(40, std::align_val_t(64));
  ::operator delete(blocks[5], std::align_val_t(64));
  for (int i = 0; i < 4; ++i) std::free(blocks[i]);
  const long counted = redysim::test::allocations - before;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  if (counted != 6) fail("the counter sees " + std::to_string(counted) + " of 6 allocations");
#else
  static_cast<void>(counted);
#endif
}

// Returns the number of allocations; with `changing`, the inputs differ in each step of the middle third.
long allocations_of_steps(const Scene& scene, const char* method, bool changing) {
  const fmi2CallbackFunctions functions{be_silent, std::calloc, std::free, nullptr, nullptr};
  const Slave slave(scene, functions, method);
  slave.good(fmi2SetDebugLogging(slave, fmi2False, 0, nullptr));  // a message takes memory
  std::vector<double> inputs(scene.forces.size(), 0), outputs(scene.outputs.size());
  // the first step warns of prescribed motions that were never set
  std::vector<double> start(scene.inputs.size());
  slave.good(fmi2GetReal(slave, scene.inputs.data(), start.size(), start.data()));
  slave.good(fmi2SetReal(slave, scene.inputs.data(), start.size(), start.data()));
  const long before = redysim::test::allocations;
  for (int k = 0; k < steps; ++k) {
    if (changing && 3 * k / steps == 1) {
      for (double& input : inputs) input = 1e-3 * (k % 7);
      slave.good(fmi2SetReal(slave, scene.forces.data(), inputs.size(), inputs.data()));
    }
    slave.good(fmi2DoStep(slave, k * step_size, step_size, fmi2True));
    slave.good(fmi2GetReal(slave, scene.outputs.data(), outputs.size(), outputs.data()));
  }
  return redysim::test::allocations - before;
}

}  // namespace

int main(int count, char** models) {
  count_each_allocator();
  bool none = true;
  for (int i = 1; i < count; ++i) {
    const Scene scene(models[i]);
    for (const char* method : methods)
      for (const bool changing : {false, true}) {
        const long allocations = allocations_of_steps(scene, method, changing);
        if (allocations == 0) continue;
        none = false;
        std::fprintf(stderr, "%s, %s, inputs %s: %ld allocations in %d steps\n", scene.name.c_str(), method,
                     changing ? "changing" : "held", allocations, steps);
      }
  }
  return none ? 0 : 1;
}
