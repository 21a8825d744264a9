#pragma once

#include <string>
#include <vector>

#include "model/contact.hpp"
#include "model/read/attached_file.hpp"
#include "model/read/link_table.hpp"

namespace redysim {

// Reads all [[contact]] tables and their height maps. All errors become findings. `folder` and `files`: see
// attached_file.hpp.
std::vector<Contact> read_contacts(Section& top, const LinkTable& links, bool degrees, Names& names,
                                   const std::string& folder, std::vector<AttachedFile>& files,
                                   Findings& findings);

}  // namespace redysim
