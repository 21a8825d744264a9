// whole_life MODEL.toml...: all that can happen to an instance, good and bad, with memory that is counted.
// Under memcheck nothing may be read before it is written, nothing beyond its end, and nothing may be left
// (scripts/memcheck.sh).

#include <cstring>
#include <limits>

#include "scene.hpp"

namespace {

using namespace redysim::process;

constexpr double step_size = 1e-3;
constexpr double euler_step = 1e-6;  // stable for the stiff scenes, too
int blocks = 0;

void* allocate(std::size_t count, std::size_t size) {
  ++blocks;
  return std::malloc(count * size);  // not cleared, so that memcheck sees what is read too early
}
void release(void* block) {
  --blocks;
  std::free(block);
}
constexpr fmi2CallbackFunctions functions{be_silent, allocate, release, nullptr, nullptr};

// Saved, serialised, cut, damaged, taken over again, overwritten; one is left to the instance.
void mistreat_states(const Slave& slave) {
  fmi2FMUstate state = nullptr, copy = nullptr, left = nullptr;
  std::size_t size = 0;
  slave.good(fmi2GetFMUstate(slave, &left));
  slave.good(fmi2GetFMUstate(slave, &state));
  slave.good(fmi2SerializedFMUstateSize(slave, state, &size));
  std::vector<char> bytes(size);
  slave.bad(fmi2SerializeFMUstate(slave, state, bytes.data(), size - 1));
  slave.good(fmi2SerializeFMUstate(slave, state, bytes.data(), size));
  for (std::size_t length = 0; length < size; length += 13) {
    const std::vector<char> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    slave.bad(fmi2DeSerializeFMUstate(slave, cut.data(), length, &copy));
  }
  slave.bad(fmi2SetFMUstate(slave, bytes.data()));
  slave.good(fmi2DeSerializeFMUstate(slave, bytes.data(), size, &copy));
  slave.good(fmi2SetFMUstate(slave, copy));
  slave.good(fmi2GetFMUstate(slave, &copy));
  slave.good(fmi2FreeFMUstate(slave, &copy));
  slave.good(fmi2FreeFMUstate(slave, &state));
}

void ask_for_the_impossible(const Slave& slave, const Scene& scene) {
  const fmi2ValueReference unknown = 1u << 30;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  double value = 0;
  slave.bad(fmi2GetReal(slave, &unknown, 1, &value));
  slave.bad(fmi2GetReal(slave, nullptr, 1, nullptr));
  slave.bad(fmi2SetReal(slave, scene.outputs.data(), 1, &value));
  slave.bad(fmi2DoStep(slave, 0, nan, fmi2True));
  slave.bad(fmi2DoStep(slave, -1, step_size, fmi2True));
  slave.bad(fmi2CancelStep(slave));
}

// Forces beyond measure stop a step where there are inputs for them.
void fail_a_step(const Slave& slave, const Scene& scene, int k) {
  const std::vector<double> forces(scene.forces.size(), 1e308);
  if (forces.empty()) return;
  slave.good(fmi2SetReal(slave, scene.forces.data(), forces.size(), forces.data()));
  slave.bad(fmi2DoStep(slave, k * step_size, step_size, fmi2True));
  fmi2FMUstate state = nullptr;
  slave.good(fmi2GetFMUstate(slave, &state));
  slave.good(fmi2SetFMUstate(slave, state));
}

void live(const Scene& scene, const char* method) {
  const Slave slave(scene, functions, method);
  for (int turn = 0; turn < 2; ++turn) {
    int k = 0;
    for (; k < 10; ++k) slave.step(k, step_size, 1e-3 * k);
    slave.outputs();
    slave.derivatives();
    mistreat_states(slave);
    for (; k < 20; ++k) slave.step(k, step_size, 0);
    ask_for_the_impossible(slave, scene);
    fail_a_step(slave, scene, k);
    if (turn == 1) slave.good(fmi2Terminate(slave));
    slave.good(fmi2Reset(slave));
    slave.start(method);
  }
}

void be_refused(const Scene& scene) {
  const char* guids[] = {"", nullptr, scene.guid.c_str()};
  for (const char* guid : guids)
    if (fmi2Instantiate("none", fmi2CoSimulation, guid, guid == guids[2] ? "/nowhere" : scene.folder.c_str(),
                        &functions, fmi2False, fmi2True))
      fail(scene.name + " should not be instantiated");
}

// Model exchange: Euler steps with events, a saved state, a reset, an end without fmi2Terminate.
void be_integrated(const Scene& scene) {
  const Slave slave(scene, functions, methods[0], fmi2ModelExchange);
  std::vector<double> y(static_cast<std::size_t>(scene.states)), slope(y), unit(y);
  for (int turn = 0; turn < 2; ++turn) {
    fmi2EventInfo info;
    fmi2Boolean wants_event = fmi2False, ends = fmi2False;
    slave.good(fmi2NewDiscreteStates(slave, &info));
    slave.good(fmi2EnterContinuousTimeMode(slave));
    slave.good(fmi2GetNominalsOfContinuousStates(slave, unit.data(), unit.size()));
    slave.good(fmi2GetContinuousStates(slave, y.data(), y.size()));
    for (int k = 0; k < 10; ++k) {
      slave.good(fmi2GetDerivatives(slave, slope.data(), slope.size()));
      for (std::size_t i = 0; i < y.size(); ++i) y[i] += euler_step * slope[i];
      slave.good(fmi2SetTime(slave, (k + 1) * euler_step));
      slave.good(fmi2SetContinuousStates(slave, y.data(), y.size()));
      slave.good(fmi2CompletedIntegratorStep(slave, fmi2True, &wants_event, &ends));
    }
    slave.outputs();
    slave.derivatives();
    mistreat_states(slave);
    slave.bad(fmi2SetContinuousStates(slave, y.data(), y.size() + 1));
    slave.bad(fmi2DoStep(slave, 0, step_size, fmi2True));
    slave.good(fmi2EnterEventMode(slave));
    slave.good(fmi2NewDiscreteStates(slave, &info));
    if (turn == 1) return;
    slave.good(fmi2Reset(slave));
    slave.start(methods[0]);
  }
}

}  // namespace

int main(int count, char** models) {
  for (int i = 1; i < count; ++i) {
    const Scene scene(models[i]);
    be_refused(scene);
    for (const char* method : methods) live(scene, method);
    be_integrated(scene);
    if (blocks != 0) fail(scene.name + ": the environment's memory was not given back");
    std::printf("%s: lived with every method\n", scene.name.c_str());
  }
  return 0;
}
