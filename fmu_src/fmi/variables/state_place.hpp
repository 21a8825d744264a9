#pragma once

#include <vector>

#include "fmi/variables/variables.hpp"
#include "integrate/system/independent_coordinates.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// Index in y of the part that a variable represents; -1: the model does not integrate it.
int place_of(const System& system, StatePart part, const Variable& variable);

// Index among the states of model exchange (kept entries of y, independent positions, independent
// velocities); -1: none.
int exchanged_place(const System& system, const IndependentCoordinates& states, StatePart part,
                    const Variable& variable);

// Indices of a velocity of the tree and of its position in the state.
struct CoordinatePlace {
  int position, velocity;  // of a spherical joint: the first position; -1: prescribed
  int joint;               // index into the plan
  int ball, axis;          // ball -1: a joint with one degree of freedom
};
// All velocities in the order of the tree (dynamics/equation_terms.hpp).
std::vector<CoordinatePlace> coordinate_places(const System& system);

}  // namespace redysim
