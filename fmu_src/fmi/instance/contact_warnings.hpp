#pragma once

#include <string>
#include <vector>

#include "dynamics/workspace.hpp"
#include "model/model.hpp"

namespace redysim {

struct ContactWarning {
  int contact;  // index in the model
  std::string sentence;
};

// Warnings about contacts at the start: deep penetration, whose force would accelerate the bodies strongly,
// and box corners close to an edge of another box. Uses ws.ground.
std::vector<ContactWarning> contact_warnings(const Model& model, const Plan<double>& plan,
                                             const Workspace<double>& ws);

}  // namespace redysim
