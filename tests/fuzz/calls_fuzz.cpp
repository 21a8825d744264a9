// Any sequence of calls, two bytes each: whatever was done, statuses are legal and a reset brings back the
// first run bit by bit.

#include <cstddef>
#include <cstdint>
#include <limits>

#include "slave.hpp"

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double numbers[] = {0,     1e-3,     0.01,      0.05, -1,  1, 1e-12, 5e-324,
                              1e308, infinity, -infinity, nan,  0.3, 2, -0.5,  1e6};

class Master {
 public:
  void call(unsigned what, unsigned with) {
    const double number = numbers[with % 16];
    const fmi2ValueReference reference = with / 2;
    double value = number;
    int integer = static_cast<int>(with % 5) - 1;
    const char* text[] = {with % 3 == 0 ? "bdf" : with % 3 == 1 ? "adams" : "nonsense"};
    fmi2FMUstate& state = states_[with % 3];
    switch (what % 20) {
      case 0:
        return check(fmi2SetupExperiment(slave_, with & 1, number, numbers[with / 16], with & 2, 10));
      case 1:
        return check(fmi2EnterInitializationMode(slave_));
      case 2:
        return check(fmi2ExitInitializationMode(slave_));
      case 3:
        return check(fmi2DoStep(slave_, time(), number > 1 && number < infinity ? 0.1 : number, fmi2True));
      case 4:
        return check(fmi2DoStep(slave_, number, 0.01, fmi2True));
      case 5:
        return check(fmi2Terminate(slave_));
      case 6:
        return check(fmi2Reset(slave_));
      case 7:
        return check(fmi2SetReal(slave_, &reference, 1, &number));
      case 8:
        return check(fmi2GetReal(slave_, &reference, 1, &value));
      case 9:
        return check(fmi2GetFMUstate(slave_, &state));
      case 10:
        return check(fmi2SetFMUstate(slave_, state));
      case 11:
        return check(fmi2FreeFMUstate(slave_, &state));
      case 12:
        return check(fmi2SetRealInputDerivatives(slave_, &reference, 1, &integer, &number));
      case 13:
        return check(fmi2GetRealOutputDerivatives(slave_, &reference, 1, &integer, &value));
      case 14: {
        const fmi2ValueReference known = with % 16;
        return check(fmi2GetDirectionalDerivative(slave_, &reference, 1, &known, 1, &number, &value));
      }
      case 15:
        return check(fmi2SetString(slave_, &reference, with & 1, text));
      case 16:
        return check(fmi2SetDebugLogging(slave_, with & 1, with % 2, text));
      case 17:
        return check(fmi2CancelStep(slave_));
      case 18:
        return check(fmi2GetInteger(slave_, &reference, 1, &integer));
      default:
        return check(fmi2GetReal(slave_, nullptr, with % 2, nullptr));
    }
  }

  double run_anew() {
    fmi2Reset(slave_);
    fmi2SetupExperiment(slave_, fmi2False, 0, 0, fmi2False, 0);
    fmi2EnterInitializationMode(slave_);
    fmi2ExitInitializationMode(slave_);
    fmi2DoStep(slave_, 0, 0.01, fmi2True);
    const fmi2ValueReference reference = 2;
    double q = 0;
    if (fmi2GetReal(slave_, &reference, 1, &q) != fmi2OK) __builtin_trap();
    return q;
  }

 private:
  static void check(fmi2Status status) {
    if (status != fmi2OK && status != fmi2Error) __builtin_trap();
  }
  double time() {
    double time = 0;
    fmi2GetRealStatus(slave_, fmi2LastSuccessfulTime, &time);
    return time;
  }
  redysim::fuzz::Slave slave_;
  fmi2FMUstate states_[3] = {};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const double expected = Master().run_anew();
  Master master;
  for (std::size_t i = 0; i + 1 < size && i < 200; i += 2) master.call(data[i], data[i + 1]);
  if (master.run_anew() != expected) __builtin_trap();
  return 0;
}
