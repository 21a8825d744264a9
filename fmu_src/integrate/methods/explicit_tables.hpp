#pragma once

#include <arkode/arkode_erkstep.h>

#include <memory>
#include <type_traits>

namespace redysim {

struct ButcherTableDeleter {
  void operator()(ARKodeButcherTable table) const { ARKodeButcherTable_Free(table); }
};
using ButcherTable = std::unique_ptr<std::remove_pointer_t<ARKodeButcherTable>, ButcherTableDeleter>;

// Explicit Runge-Kutta tables. ARKODE has those of order 3 and 5, but only together with all its others, 10
// kB.

// Bogacki and Shampine (1989), order 3 with an embedded order 2, and Dormand and Prince (1980), RK5(4)7M.
ButcherTable bogacki_shampine_3();
ButcherTable dormand_prince_5();

}  // namespace redysim
