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
  // The numbers of the calls are part of the corpus.
  void call(unsigned what, unsigned with) {
    what %= 20;
    const bool lives = what <= 6 || what == 16 || what == 17;
    check(lives                     ? live(what, with)
          : what >= 9 && what <= 11 ? handle_state(what, with)
                                    : exchange(what, with));
  }

  double run_anew() {
    fmi2Reset(slave_);
    fmi2SetupExperiment(slave_, fmi2False, 0, 0, fmi2False, 0);
    fmi2EnterInitializationMode(slave_);
    fmi2ExitInitializationMode(slave_);
    fmi2DoStep(slave_, 0, 0.01, fmi2True);
    const fmi2ValueReference reference = 3;  // the first joint's q
    double q = 0;
    if (fmi2GetReal(slave_, &reference, 1, &q) != fmi2OK) __builtin_trap();
    return q;
  }

 private:
  fmi2Status live(unsigned what, unsigned with) {
    const double number = numbers[with % 16];
    const char* categories[] = {with % 3 == 0 ? "logAll" : "nonsense"};
    switch (what) {
      case 0:
        return fmi2SetupExperiment(slave_, with & 1, number, numbers[with / 16], with & 2, 10);
      case 1:
        return fmi2EnterInitializationMode(slave_);
      case 2:
        return fmi2ExitInitializationMode(slave_);
      case 3:
        return fmi2DoStep(slave_, time(), number > 1 && number < infinity ? 0.1 : number, fmi2True);
      case 4:
        return fmi2DoStep(slave_, number, 0.01, fmi2True);
      case 5:
        return fmi2Terminate(slave_);
      case 6:
        return fmi2Reset(slave_);
      case 16:
        return fmi2SetDebugLogging(slave_, with & 1, with % 2, categories);
      default:
        return fmi2CancelStep(slave_);
    }
  }
  fmi2Status handle_state(unsigned what, unsigned with) {
    fmi2FMUstate& state = states_[with % 3];
    return what == 9    ? fmi2GetFMUstate(slave_, &state)
           : what == 10 ? fmi2SetFMUstate(slave_, state)
                        : fmi2FreeFMUstate(slave_, &state);
  }
  fmi2Status exchange(unsigned what, unsigned with) {
    const double number = numbers[with % 16];
    const fmi2ValueReference reference = with / 2, known = with % 16;
    double value = number;
    int integer = static_cast<int>(with % 5) - 1;
    const char* text[] = {with % 3 == 2 ? "bdf" : with % 3 == 1 ? "adams" : "nonsense"};
    switch (what) {
      case 7:
        return fmi2SetReal(slave_, &reference, 1, &number);
      case 8:
        return fmi2GetReal(slave_, &reference, 1, &value);
      case 12:
        return fmi2SetRealInputDerivatives(slave_, &reference, 1, &integer, &number);
      case 13:
        return fmi2GetRealOutputDerivatives(slave_, &reference, 1, &integer, &value);
      case 14:
        return fmi2GetDirectionalDerivative(slave_, &reference, 1, &known, 1, &number, &value);
      case 15:
        return fmi2SetString(slave_, &reference, with & 1, text);
      case 18:
        return fmi2GetInteger(slave_, &reference, 1, &integer);
      default:
        return fmi2GetReal(slave_, nullptr, with % 2, nullptr);
    }
  }
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
