#pragma once

#ifdef __SSE2__
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace redysim {

// Sets IEEE 754's defaults (round to nearest, no traps, no flushing) during its lifetime, then restores the
// modes and flags of the environment. Otherwise a trap set by the master would stop its process in a trial
// step that is later rejected, and a failed step would leave flags set.
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
