#pragma once

#include <vector>

#include "math/tape.hpp"

namespace redysim {

// The operations that `results` need, in an order with few values in use at a time, so that a compiler spills
// fewer registers. Operands come before their users, except across chains (two_chains).
//
// two_chains: operations that do not depend on speeds and forces alternate with those that do, except for the
// solution at the end. That suits composite bodies, where inertias and forces follow from separate chains of
// operations; a processor works on both at once. In the recursion one chain needs the other at each joint.
std::vector<int> statement_order(const Tape& tape, const std::vector<int>& results, bool two_chains);

}  // namespace redysim
