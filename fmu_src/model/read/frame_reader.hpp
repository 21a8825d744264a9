#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/read/findings.hpp"
#include "model/read/loop_reader.hpp"
#include "model/read/names.hpp"
#include "model/read/section.hpp"

namespace redysim {

// Reads all [[frame]] tables; loops and couplings of `model` must be read before. All errors become findings.
std::vector<Frame> read_frames(Section& top, const Model& model, const LinkTable& links, bool degrees,
                               Names& names, Findings& findings);

}  // namespace redysim
