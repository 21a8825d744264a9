#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/attached_file.hpp"
#include "model/read/names.hpp"

// [[trajectory]] tables.

namespace redysim {

// `folder`: of the model file, with its final slash, or empty. `files` receives each table that was read.
std::vector<Trajectory> read_trajectories(Section& top, const Model& model, bool degrees,
                                          const std::string& folder, std::vector<AttachedFile>& files,
                                          Findings& findings);

}  // namespace redysim
