#pragma once

#include <vector>

#include "math/tape.hpp"

namespace redysim {

// The operations that `results` need, ordered such that few values are in use at a time and the compiler
// spills fewer registers. Operands precede their users, except across chains (two_chains).
//
// two_chains: operations that do not depend on speeds and forces alternate with those that do, except for the
// solution at the end. This suits composite bodies, where inertias and forces form separate chains of
// operations, on which a processor works in parallel. In the recursion, one chain needs the other at each
// joint.
std::vector<int> statement_order(const Tape& tape, const std::vector<int>& results, bool two_chains);

}  // namespace redysim
