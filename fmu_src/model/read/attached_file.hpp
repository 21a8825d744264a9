#pragma once

#include <string>
#include <vector>

#include "model/read/section.hpp"

namespace redysim {

// A file in the folder of the model file to which the model file refers.
struct AttachedFile {
  std::string name, bytes;
};

// Returns the file named by the field `file`, or null after reporting that it cannot be read. `folder`:
// folder of the model file with a final slash, or empty. Each file is read once. The pointer is valid until
// the next call.
const AttachedFile* attach(Section& section, const std::string& folder, std::vector<AttachedFile>& files);

}  // namespace redysim
