#pragma once

#include <ctime>

namespace redysim::drive {

// On a busy machine a bound on CPU time may take up to this factor of wall-clock time.
constexpr double most_waiting = 10;

#ifdef _WIN32
// Windows counts CPU time in units of 16 ms, longer than a run: wall-clock time
constexpr clockid_t thread_clock = CLOCK_MONOTONIC;
#else
constexpr clockid_t thread_clock = CLOCK_THREAD_CPUTIME_ID;
#endif

// CPU time of this thread, s, hardly affected by other load of the machine. Reading it takes too long for
// single steps.
inline double computing_seconds(clockid_t clock = thread_clock) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace redysim::drive
