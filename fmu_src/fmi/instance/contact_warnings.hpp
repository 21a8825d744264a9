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

// What is unusual about the contacts at the start: bodies deep in each other, whose force would hurl them
// apart, and corners of a box exactly at the edge of another. Uses ws.ground.
std::vector<ContactWarning> contact_warnings(const Model& model, const Plan<double>& plan,
                                             const Workspace<double>& ws);

}  // namespace redysim
