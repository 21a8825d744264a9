#pragma once

#include "model/model.hpp"
#include "model/read/section.hpp"

namespace redysim {

SolverSettings read_solver(Section& top, Findings& findings);

// [fmu]; `model` holds the links whose parameters may be tunable.
ReportSettings read_report(Section& top, Findings& findings);
FmuSettings read_fmu(Section& top, const Model& model, Findings& findings);

// Every parameter that [fmu] tunable may list: "link3.mass", "link3.com[1]", "joint2.damping",
// "gravity[3]"...
std::vector<std::string> tunable_names(const Model& model);

}  // namespace redysim
