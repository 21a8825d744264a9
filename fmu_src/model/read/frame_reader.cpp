#include "model/read/frame_reader.hpp"

#include <algorithm>

namespace redysim {
namespace {

void read_outputs(Section& section, Frame& frame) {
  if (!section.has("outputs")) return;
  const std::vector<bool> shown =
      section.flags("outputs", {"pose", "rotation", "velocity", "acceleration", "imu", "wrench", "jacobian",
                                "jacobian_rate", "inverse_inertia", "power"});
  frame.pose = shown[0];
  frame.rotation_matrix = shown[1];
  frame.velocity = shown[2];
  frame.acceleration = shown[3];
  frame.imu = shown[4];
  frame.wrench = shown[5];
  frame.jacobian = shown[6];
  frame.jacobian_rate = shown[7];
  frame.inverse_inertia = shown[8];
  frame.power = shown[9];
}

// A wrist sensor requires a fixed joint. A joint with several DOF consists of links "<name>[1]", ...
void check_sensor(Section& section, const Frame& frame, const LinkTable& links) {
  if (!frame.wrench || links.carriers.empty()) return;
  const std::string& name = links.names[frame.link];
  const int carrier = links.carriers[frame.link];
  const bool moves =
      carrier == frame.link || (carrier != ground && links.names[carrier].rfind(name + "[", 0) == 0);
  if (moves)
    section.error("outputs",
                  "outputs contains 'wrench', which requires a link with joint 'fixed', but link '" + name +
                      "' can move relative to its parent");
}

// The factors of the mass matrix do not include constraints.
void check_inertia(Section& section, const Frame& frame, const Model& model) {
  if (frame.inverse_inertia && model.has_constraints())
    section.error("outputs",
                  "outputs contains 'inverse_inertia', which does not support loops and rigid couplings");
}

Frame read_frame(Section section, const std::string& label, const Model& model, const LinkTable& links,
                 bool degrees, Names& names) {
  Frame frame;
  frame.name = names.take(section, label);
  section.require("link");
  const std::string first = links.names.empty() ? std::string() : links.names.front();
  frame.link = section.has("link") ? links.index.find(section.text("link", first), "link", section, 0) : 0;
  if (frame.link == ground) {
    section.error("link", "link must be a moving or fixed link, not 'ground'");
    frame.link = 0;
  }
  frame.position = section.vector("position", frame.position);
  frame.rotation = section.rotation("rpy", degrees);
  read_outputs(section, frame);
  check_sensor(section, frame, links);
  check_inertia(section, frame, model);
  frame.port = section.choice<Frame::Port>(
      "port",
      {{"none", Frame::Port::none}, {"ground", Frame::Port::ground_axes}, {"frame", Frame::Port::frame_axes}},
      Frame::Port::none);
  if (frame.power && frame.port == Frame::Port::none)
    section.error("outputs", "outputs contains 'power', which requires a port");
  section.refuse_unknown();
  return frame;
}

}  // namespace

std::vector<Frame> read_frames(Section& top, const Model& model, const LinkTable& links, bool degrees,
                               Names& names, Findings& findings) {
  std::vector<Frame> frames;
  for (const Value* table : top.tables("frame")) {
    const std::string label = label_of("frame", frames.size() + 1, *table);
    frames.push_back(read_frame(Section(*table, label, findings), label, model, links, degrees, names));
  }
  return frames;
}

}  // namespace redysim
