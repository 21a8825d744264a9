#pragma once

#include <vector>

#include "model/findings.hpp"
#include "model/loop_reader.hpp"
#include "model/model.hpp"
#include "model/names.hpp"
#include "model/section.hpp"

namespace redysim {

// Reads all [[frame]] tables. Every error becomes a finding.
std::vector<Frame> read_frames(Section& top, const LinkTable& links, bool degrees, Names& names,
                               Findings& findings);

}  // namespace redysim
