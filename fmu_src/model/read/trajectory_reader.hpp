#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/attached_file.hpp"
#include "model/read/names.hpp"

// [[trajectory]] tables.

namespace redysim {

// `folder`: folder of the model file with a final slash, or empty. `files` receives each table file that is
// read.
std::vector<Trajectory> read_trajectories(Section& top, const Model& model, bool degrees,
                                          const std::string& folder, std::vector<AttachedFile>& files,
                                          Findings& findings);

}  // namespace redysim
