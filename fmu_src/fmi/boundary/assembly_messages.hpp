#pragma once

#include <string>
#include <vector>

#include "dynamics/assembly/assembly.hpp"
#include "dynamics/assembly/freedom.hpp"
#include "dynamics/assembly/movability.hpp"
#include "integrate/system/equilibrium.hpp"

// User messages about the start of a model: assembly, degrees of freedom, singular mass matrix.

namespace redysim {

// "loop 'x'" or "coupling 'x'", and its position in the model file. `constraint`: index of Assembly; < 0: the
// first constraint.
struct ConstraintPlace {
  std::string label;
  int line = 0, column = 0;
};
ConstraintPlace constraint_at(const Model& model, int constraint);

// Why an assembly failed, e.g. "loop 'x': no configuration satisfies the loop constraints; smallest residual
// 0.17 m". Empty if it succeeded.
std::string failure(const Model& model, const Assembly& assembly);

// The corrections of an assembly above 1e-9 rad or m (per s), one sentence each for positions and velocities:
// "initial configuration violates the loop constraints by 26.1 mm; corrected: joint2 by -0.262 rad".
std::vector<std::string> corrections(const Model& model, const Plan<double>& plan, const Assembly& assembly);

// "loop 'x': prescribed accelerations violate its constraints by 0.05 m/s^2".
std::string misfit(const Model& model, int constraint, const Assembly::Residual& acceleration);

// Why no rest configuration was found, one sentence; empty if one was found.
std::string failure(const Model& model, const Plan<double>& plan, const Rest& rest);

// "1 motion for 1 degree of freedom: fully driven", "1 motion for 3 degrees of freedom: 2 are not prescribed
// and are integrated", "3 motions for 1 degree of freedom: 2 motions more than degrees of freedom, ..."
std::string sentence(const Freedom& freedom);

// "joint 'elbow': the mass matrix is singular, ..." with the remedy; `where`: " at the start pose" or empty.
std::string singular_sentence(const Model& model, const Plan<double>& plan, int joint, const char* where);

}  // namespace redysim
