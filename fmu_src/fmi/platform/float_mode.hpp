#pragma once

#ifdef __SSE2__
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace redysim {

// Computes with IEEE 754's defaults (to nearest, no traps, no flushing) for as long as it lives, then gives
// the environment back its modes and flags. A trap that a master has set would otherwise stop its process
// in a trial step that leads nowhere, and a step that fails would leave its flags behind.
class FloatMode {
 public:
  FloatMode(const FloatMode&) = delete;
  FloatMode& operator=(const FloatMode&) = delete;

#ifdef __SSE2__
  FloatMode() : theirs_(_mm_getcsr()) { _mm_setcsr(all_masked); }
  ~FloatMode() { _mm_setcsr(theirs_); }

 private:
  static constexpr unsigned all_masked = 0x1f80;
  unsigned theirs_;
#else
  FloatMode() {
    std::feholdexcept(&theirs_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~FloatMode() { std::fesetenv(&theirs_); }

 private:
  std::fenv_t theirs_;
#endif
};

}  // namespace redysim
