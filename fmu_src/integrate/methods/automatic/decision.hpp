#pragma once

#include <string>

#include "integrate/methods/automatic/memory.hpp"

namespace redysim {

// The last decision of `auto`.
struct Decision {
  enum class Event : std::uint8_t { tries, keeps, returns, restarts, replaces };
  Event event = Event::tries;
  Choice method = Choice::erk, other = Choice::erk;
  double time = 0;                  // s
  double cost = 0, other_cost = 0;  // of both methods: right-hand sides of erk per second of simulated time

  std::string text() const;  // for the log
};

}  // namespace redysim
