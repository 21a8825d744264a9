#pragma once

#include <filesystem>
#include <string>

#include "model/read/model_file.hpp"
#include "support/mechanisms.hpp"

// The scenes of the straight-line benchmark: model files, and chains with right angles or angles of any size.

namespace redysim::bench {

inline Model straight_line_scene(const std::string& name) {
  for (const char* folder : {"/models/", "/bench/scenes/"}) {
    const std::string file = REDYSIM_SOURCE + (folder + name) + ".toml";
    if (std::filesystem::exists(file)) return read_model_file(file).model;
  }
  return test::serial_chain(std::stoi(name.substr(name.rfind('_') + 1)), name.rfind("right", 0) == 0);
}

}  // namespace redysim::bench
