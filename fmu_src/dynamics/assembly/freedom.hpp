#pragma once

#include "model/parameters.hpp"

namespace redysim {

// Degrees of freedom of a system with prescribed motions and closed loops in one configuration:
// motions - surplus + left = system.
struct Freedom {
  int motions = 0;  // prescribed joints
  int system = 0;   // degrees of freedom with all joints free
  int left = 0;     // of these not prescribed, integrated
  int surplus = 0;  // motions determined by the others, which must be consistent with the loops
};

// From ranks at q (per joint of the plan), so singular configurations have their own result. Allocates.
Freedom freedom(const Model& model, const Parameters<double>& parameters, const double* q);

}  // namespace redysim
