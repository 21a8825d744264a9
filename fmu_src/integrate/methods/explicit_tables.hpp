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

// Prince and Dormand (1981), RK8(7)13M: order 8 with an embedded order 7. The error estimate of SUNDIALS' own
// table of order 8 (Fehlberg) compares two slopes at the start of the step and two at its end. If these agree
// it is zero, so it misses a stop that only the end of the step reaches.
ButcherTable dormand_prince_8();

}  // namespace redysim
