#include "drive/watchdog.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "drive/computing_time.hpp"
#include "fmi/describe/json.hpp"

namespace redysim::drive {

Watchdog::Watchdog(double seconds) : thread_([this, seconds] { watch(seconds); }) {}

Watchdog::~Watchdog() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    finished_ = true;
  }
  done_.notify_one();
  thread_.join();
}

void Watchdog::watch(double seconds) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto begin = std::chrono::steady_clock::now();
  const std::chrono::duration<double> look(std::min(0.1, seconds / 4)), longest(most_waiting * seconds);
  while (!done_.wait_for(lock, look, [this] { return finished_; }))
    if (computing_seconds(CLOCK_PROCESS_CPUTIME_ID) > seconds ||
        std::chrono::steady_clock::now() - begin > longest)
      break;
  if (finished_) return;
  Json json;
  json.begin_object().member("status", "hang").member("phase", phase_.load()).member("reached", time_.load());
  json.end_object();
  std::printf("%s\n", json.text().c_str());
  std::fflush(stdout);
  _exit(0);  // the other threads may never end
}

}  // namespace redysim::drive
