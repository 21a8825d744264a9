#pragma once

#include "model/model.hpp"
#include "model/read/section.hpp"

namespace redysim {

SolverSettings read_solver(Section& top, Findings& findings);

// Read [solver], [report] and [fmu]. `model` must contain everything that [fmu] may list as tunable.
ReportSettings read_report(Section& top, Findings& findings);
FmuSettings read_fmu(Section& top, const Model& model, Findings& findings);

// All parameters that [fmu] tunable may list, for example "link3.mass", "link3.com[1]", "joint2.damping",
// "gravity[3]".
std::vector<std::string> tunable_names(const Model& model);

}  // namespace redysim
