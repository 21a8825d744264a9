#include "model/read/frame_reader.hpp"

#include <algorithm>

#include "model/read/suggest.hpp"

namespace redysim {
namespace {

void read_frame_outputs(Section& section, Frame& frame) {
  if (!section.has("outputs")) return;
  const std::vector<std::string> groups = {"pose", "rotation", "velocity"};
  bool* const flags[] = {&frame.pose, &frame.rotation_matrix, &frame.velocity};
  for (bool* flag : flags) *flag = false;
  for (const auto& [group, place] : section.texts("outputs")) {
    const auto found = std::find(groups.begin(), groups.end(), group);
    if (found == groups.end())
      section.error(place, "outputs must be 'pose', 'rotation' or 'velocity', got '" + group + "'" +
                               did_you_mean(group, groups));
    else
      *flags[found - groups.begin()] = true;
  }
}

Frame read_frame(Section section, const std::string& label, const LinkTable& links, bool degrees,
                 Names& names) {
  Frame frame;
  frame.name = names.take(section, label);
  if (!section.has("link")) section.error("link", "link is required");
  frame.link = section.has("link") ? links.index.find(section.text("link"), "link", section, 0) : 0;
  if (frame.link == ground) {
    section.error("link", "link must be a moving or fixed link, not 'ground'");
    frame.link = 0;
  }
  frame.position = section.vector("position", frame.position);
  frame.rotation = section.rotation("rpy", degrees);
  read_frame_outputs(section, frame);
  frame.port = section.choice<Frame::Port>(
      "port",
      {{"none", Frame::Port::none}, {"ground", Frame::Port::ground_axes}, {"frame", Frame::Port::frame_axes}},
      Frame::Port::none);
  section.refuse_unknown();
  return frame;
}

}  // namespace

std::vector<Frame> read_frames(Section& top, const LinkTable& links, bool degrees, Names& names,
                               Findings& findings) {
  std::vector<Frame> frames;
  for (const Value* table : top.tables("frame")) {
    const std::string label = label_of("frame", frames.size() + 1, *table);
    frames.push_back(read_frame(Section(*table, label, findings), label, links, degrees, names));
  }
  return frames;
}

}  // namespace redysim
