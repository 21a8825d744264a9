#pragma once

#include <ctime>

namespace redysim::drive {

// Computing time of this thread, s: other work on the machine counts little. Reading it takes too long for
// single steps.
inline double computing_seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace redysim::drive
