#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/attached_file.hpp"
#include "model/read/names.hpp"

// [[trajectory]] tables.

namespace redysim {

// The moving joints with one DOF, by name.
class JointIndex {
 public:
  explicit JointIndex(const Model& model);

  // The link whose joint has this name, or -1 with a finding at `place`.
  int find(const std::string& name, const std::string& key, Place place, Section& section) const;

 private:
  std::vector<std::string> names_;
  std::vector<int> links_;
};

// `folder`: of the model file, with its final slash, or empty. `files` receives each table that was read.
std::vector<Trajectory> read_trajectories(Section& top, const Model& model, bool degrees,
                                          const std::string& folder, std::vector<AttachedFile>& files,
                                          Findings& findings);

}  // namespace redysim
