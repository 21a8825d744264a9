#pragma once

#include <ctime>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

// The conversation of every program here with work_precision.py. A line `METHOD VALUE` (a tolerance or a
// step, as the method wants it) is answered by `SECONDS ROWS COLUMNS` and the rows: the joints' positions at
// the scene's output times. SECONDS is the CPU time of one run without its set-up. A run that fails answers
// `failed REASON`.

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

// Answers until the input ends. Short runs are repeated, and their mean is the answer.
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
