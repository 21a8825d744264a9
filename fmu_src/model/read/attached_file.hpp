#pragma once

#include <string>
#include <vector>

#include "model/read/section.hpp"

namespace redysim {

// A file in the folder of the model file, to which the model file refers.
struct AttachedFile {
  std::string name, bytes;
};

// The file that the field `file` names; null with a finding if it cannot be read. `folder`: of the model
// file, with its final slash, or empty. Each file is read once; the pointer is valid until the next call.
const AttachedFile* attach(Section& section, const std::string& folder, std::vector<AttachedFile>& files);

}  // namespace redysim
