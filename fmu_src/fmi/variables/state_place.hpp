#pragma once

#include <vector>

#include "fmi/variables/variables.hpp"
#include "integrate/system/independent_coordinates.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// The place in y of the part of a variable; -1: the model does not integrate it.
int place_of(const System& system, StatePart part, const Variable& variable);

// The place among the states of a master: entries of y that it keeps, independent positions, independent
// velocities; -1: none.
int exchanged_place(const System& system, const IndependentCoordinates& states, StatePart part,
                    const Variable& variable);

// A velocity of the tree and its position in the state.
struct CoordinatePlace {
  int position, velocity;  // the first ones of a spherical joint; -1: prescribed
  int joint;               // of the plan
  int ball, axis;          // ball -1: of a joint with one degree of freedom
};
// In the order of the tree (dynamics/equation_terms.hpp).
std::vector<CoordinatePlace> coordinate_places(const System& system);

}  // namespace redysim
