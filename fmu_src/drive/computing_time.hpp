#pragma once

#include <ctime>

namespace redysim::drive {

// Maximum ratio of wall-clock time to CPU time before a limit on CPU time ends the work on a busy machine.
constexpr double most_waiting = 10;

#ifdef _WIN32
// Wall-clock time: Windows counts CPU time in units of 16 ms, which is longer than a run.
constexpr clockid_t thread_clock = CLOCK_MONOTONIC;
#else
constexpr clockid_t thread_clock = CLOCK_THREAD_CPUTIME_ID;
#endif

// CPU time of this thread in s; other load of the machine hardly affects it. Too slow for timing single
// steps.
inline double computing_seconds(clockid_t clock = thread_clock) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace redysim::drive
