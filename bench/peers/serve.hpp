#pragma once

#include <ctime>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

// Protocol of the programs of this folder with work_precision.py. Request: a line `METHOD VALUE` (tolerance
// or number of steps, depending on the method). Answer: `SECONDS ROWS COLUMNS` and the rows, the joint
// positions at the output times of the scene. SECONDS is the CPU time of one run without its set-up. A failed
// run answers `failed REASON`.

namespace redysim::bench {

struct Run {
  double seconds = 0;
  std::vector<double> rows;
  std::string failure;
};

inline double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Answers requests until the input ends. Short runs are repeated and averaged.
inline void serve(std::size_t columns, const std::function<Run(const std::string&, double)>& run) {
  constexpr double enough = 0.02;
  std::cout.precision(17);
  std::string method;
  double value = 0;
  while (std::cin >> method >> value) {
    Run result;
    double seconds = 0;
    int runs = 0;
    while (seconds < enough && result.failure.empty()) {
      result = run(method, value);
      seconds += result.seconds;
      ++runs;
    }
    if (!result.failure.empty()) {
      std::cout << "failed " << result.failure << std::endl;
      continue;
    }
    std::cout << seconds / runs << ' ' << result.rows.size() / columns << ' ' << columns << '\n';
    for (std::size_t i = 0; i < result.rows.size(); ++i)
      std::cout << result.rows[i] << ((i + 1) % columns ? ' ' : '\n');
    std::cout << std::flush;
  }
}

}  // namespace redysim::bench
