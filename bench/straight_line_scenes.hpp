#pragma once

#include <string>

#include "model/read/model_file.hpp"
#include "support/mechanisms.hpp"

// The scenes of the straight-line benchmark: model files, and chains of joints of any geometry.

namespace redysim::bench {

inline Model straight_line_scene(const std::string& name) {
  const std::string chain = "any_angle_chain_";
  if (name.compare(0, chain.size(), chain) == 0)
    return test::serial_chain(std::stoi(name.substr(chain.size())), false);
  return read_model_file(REDYSIM_MODELS "/" + name + ".toml").model;
}

}  // namespace redysim::bench
