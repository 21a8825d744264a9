#pragma once

#include <arkode/arkode_erkstep.h>

#include <memory>
#include <type_traits>

namespace redysim {

struct ButcherTableDeleter {
  void operator()(ARKodeButcherTable table) const { ARKodeButcherTable_Free(table); }
};
using ButcherTable = std::unique_ptr<std::remove_pointer_t<ARKodeButcherTable>, ButcherTableDeleter>;

// Prince and Dormand (1981), RK8(7)13M: order 8 with an embedded order 7. SUNDIALS' own table of order 8,
// Fehlberg's, compares two slopes at the step's start and two at its end: where these agree it sees no error,
// and walks into a stop that only the end of the step touches.
ButcherTable dormand_prince_8();

}  // namespace redysim
