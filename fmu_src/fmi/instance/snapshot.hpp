#pragma once

#include <cstddef>
#include <vector>

#include "fmi/instance/life.hpp"
#include "fmi/instance/parameter_set.hpp"
#include "fmi/instance/prescribed_motion.hpp"
#include "fmi/instance/saved_states.hpp"

namespace redysim {

// The content of a saved state: all data that determine the continuation of an instance.
struct Snapshot {
  // Array lengths.
  struct Sizes {
    std::size_t parameters, scales, motions;
  };

  Life life;
  double time = 0, energy_offset = 0;
  bool follows_motion = true;
  ParameterSet::Pending pending;
  SolverMethod method = SolverMethod::erk;
  std::vector<double> parameters, inputs, applied_inputs, scales;
  PrescribedMotion::Saved motion;
  std::vector<double> step;                   // StepJacobian::saved
  const unsigned char* integrator = nullptr;  // its own bytes, after all others
  std::size_t integrator_size = 0;

  bool is_running() const {  // has an integrator
    return life.state != State::instantiated && life.state != State::initialization;
  }

  void write(Bytes& bytes) const;  // without the integrator's bytes
  // False: `bytes` are invalid for `system`. They must outlive the snapshot.
  bool read(const Bytes& bytes, const Sizes& sizes, const System& system);

 private:
  template <class Self, class Visit>
  static void each_number(Self& self, const Visit& visit);
  bool is_valid() const;
};

}  // namespace redysim
