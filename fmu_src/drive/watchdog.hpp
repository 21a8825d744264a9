#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace redysim::drive {

// Ends the process with a report when the work exceeds this CPU time, or ten times this wall-clock time,
// because a call may never return.
class Watchdog {
 public:
  explicit Watchdog(double seconds);
  ~Watchdog();
  void at(const char* phase, double time) {
    phase_.store(phase, std::memory_order_relaxed);
    time_.store(time, std::memory_order_relaxed);
  }
  void at(double time) { time_.store(time, std::memory_order_relaxed); }

 private:
  void watch(double seconds);

  std::atomic<const char*> phase_{"instantiate"};
  std::atomic<double> time_{0};
  std::mutex mutex_;
  std::condition_variable done_;
  bool finished_ = false;
  std::thread thread_;
};

}  // namespace redysim::drive
