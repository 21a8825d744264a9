#pragma once

#include <string>
#include <vector>

#include "fmi/instance/simulation.hpp"

namespace redysim {

// The inputs of prescribed joints: position, velocity and acceleration (order 0, 1, 2).
class PrescribedMotion {
 public:
  explicit PrescribedMotion(Simulation& simulation);

  void reset();  // to the start of the model
  void begin();  // starts all motions at the current time with the values set last
  // Model exchange: restarts the motions at the current time with the values set last. A motion without any
  // set value continues.
  void hold();
  std::size_t size() const { return values_.size(); }
  double value(int joint, int order) const { return values_[3 * joint + order]; }
  // Returns whether the value changed. Importers may repeat unchanged inputs or omit them, with the same
  // motion.
  bool set(int joint, int order, double value);
  void set_locked(const Variable& variable, double value);  // a locked joint has its start position
  void inputs_ended(int joint, double acceleration) { values_[3 * joint + 2] = acceleration; }

  // Names of inputs that the master has never set; empty: none. To be reported once.
  bool is_reported() const { return reported_; }
  std::string never_set();

  struct Saved {
    std::vector<double> values;
    std::vector<unsigned char> was_set;
  };
  Saved saved() const { return {values_, was_set_}; }
  void restore(Saved&& saved);

 private:
  void reset_to_start();

  Simulation& simulation_;
  std::vector<double> values_;          // 3 per joint
  std::vector<unsigned char> was_set_;  // 1: set by the master since the reset
  bool reported_ = false;
};

}  // namespace redysim
