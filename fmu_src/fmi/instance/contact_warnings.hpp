#pragma once

#include <string>
#include <vector>

#include "dynamics/workspace.hpp"
#include "model/model.hpp"

namespace redysim {

// What is unusual about the contacts at the start, a sentence each: bodies deep in each other, whose force
// would hurl them apart, and corners of a box exactly at the edge of another. Uses ws.ground.
std::vector<std::string> contact_warnings(const Model& model, const Plan<double>& plan,
                                          const Workspace<double>& ws);

}  // namespace redysim
