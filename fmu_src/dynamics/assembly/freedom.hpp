#pragma once

#include <string>

#include "model/model.hpp"

namespace redysim {

// How prescribed motions and closed loops share the freedom of a system at one pose:
// motions - surplus + left = system.
struct Freedom {
  int motions = 0;  // prescribed joints
  int system = 0;   // degrees of freedom that the loops leave, were every joint free
  int left = 0;     // of these not prescribed: they are integrated
  int surplus = 0;  // motions that follow from the others: they have to agree with the loops
};

// q: per moving joint of the model's plan. By ranks, so a singular pose shows its own freedom. Allocates.
Freedom freedom(const Model& model, const double* q);

// "1 motion for 1 degree of freedom: fully driven", "1 motion for 3 degrees of freedom: 2 are not prescribed
// and are integrated", "3 motions for 1 degree of freedom: 2 motions more than degrees of freedom, ..."
std::string sentence(const Freedom& freedom);

}  // namespace redysim
