#include "drive/watchdog.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>

#include "fmi/json.hpp"

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
  if (done_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return finished_; })) return;
  Json json;
  json.begin_object().member("status", "hang").member("phase", phase_.load()).member("reached", time_.load());
  json.end_object();
  std::printf("%s\n", json.text().c_str());
  std::fflush(stdout);
  _exit(0);  // other threads never come back
}

}  // namespace redysim::drive
