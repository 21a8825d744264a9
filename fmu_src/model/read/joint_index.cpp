#include "model/read/joint_index.hpp"

#include "model/any_of.hpp"
#include "model/read/suggest.hpp"

namespace redysim {
namespace {

bool is_of_ball(const Model& model, int link) {
  return any_of(model.balls,
                [link](const Ball& ball) { return link >= ball.chart_link && link < ball.chart_link + 4; });
}

}  // namespace

JointIndex::JointIndex(const Model& model) {
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Joint& joint = model.links[i].joint;
    if (!moves(joint) || is_of_ball(model, static_cast<int>(i))) continue;
    names_.push_back(joint.name);
    links_.push_back(static_cast<int>(i));
  }
}

int JointIndex::find(const std::string& name, std::string_view key, Place place, Section& section) const {
  for (std::size_t k = 0; k < names_.size(); ++k)
    if (names_[k] == name) return links_[k];
  section.error(place, std::string(key) + " '" + name + "' is not a moving joint with one DOF" +
                           did_you_mean(name, names_));
  return -1;
}

}  // namespace redysim
