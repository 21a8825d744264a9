#pragma once

#include <ctime>

namespace redysim::drive {

// On a busy machine a bound on computing may take so many times as long by the clock on the wall.
constexpr double most_waiting = 10;

// Computing time of this thread, s: other work on the machine counts little. Reading it takes too long for
// single steps.
inline double computing_seconds(clockid_t clock = CLOCK_THREAD_CPUTIME_ID) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace redysim::drive
