#include <cstdio>
#include <exception>

#include "dynamics/straight_line/straight_line.hpp"
#include "straight_line_scenes.hpp"

// straight_line_writer SCENE: writes the scene's forward dynamics as C++, without length limit.

int main(int count, char** arguments) {
  if (count != 2) return 2;
  try {
    const redysim::Model model = redysim::bench::straight_line_scene(arguments[1]);
    redysim::StraightLine line = redysim::straight_line(model);
    line.has_series = false;  // their symbols are those of one scene
    std::fputs(redysim::straight_line_source(line, arguments[1]).c_str(), stdout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
