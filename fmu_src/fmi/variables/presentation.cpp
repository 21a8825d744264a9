#include "fmi/variables/presentation.hpp"

#include "fmi/variables/groups.hpp"

namespace redysim {
namespace {

template <class... Group>
const Words& words_of(const Variable& variable, const std::tuple<Group...>*) {
  const Words* found = nullptr;
  (void)((&Group::rows == variable.group && (found = Group::words.words, true)) || ...);
  return found[variable.row_index()];
}

std::string owner_of(const Model& model, const Variable& variable) {
  switch (variable.row->owner) {
    case Owner::model:
      return {};
    case Owner::joint:
      return "joint '" + model.links[variable.link].joint.name + "'";
    case Owner::ball:
      return "joint '" + model.balls[variable.ball].name + "'";
    case Owner::frame:
      return "frame '" + model.frames[variable.frame].name + "'";
    case Owner::loop:
      return "loop '" + model.loops[variable.loop].name + "'";
    case Owner::coupling:
      return "coupling '" + model.couplings[variable.coupling].name + "'";
    case Owner::contact:
      return "contact '" + model.contacts[variable.contact].name + "'";
    case Owner::link:
      return "link '" + model.links[variable.link].name + "'";
  }
  return {};
}

bool slides(const Model& model, const Variable& variable) {
  return variable.row->owner == Owner::joint && !turns(model.links[variable.link].joint);
}

}  // namespace

const Words& words_of(const Variable& variable) {
  return words_of(variable, static_cast<const Groups*>(nullptr));
}

namespace {

// A spherical joint has four positions or three velocities.
std::vector<TreeCoordinate> tree_coordinates(const Model& model, bool positions) {
  std::vector<TreeCoordinate> found;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Joint& joint = model.links[i].joint;
    if (!moves(joint)) continue;
    TreeCoordinate coordinate{"joint '" + joint.name + "'", !turns(joint)};
    int part = -1;  // not part of a spherical joint
    for (const Ball& ball : model.balls)
      if (const int k = static_cast<int>(i) - ball.chart_link; 0 <= k && k < 4) {
        part = k;
        coordinate = {"joint '" + ball.name + "' (" + quaternion_components[k] + ")", false, positions};
      }
    if (positions || part != 0) found.push_back(coordinate);
  }
  return found;
}

}  // namespace

std::vector<TreeCoordinate> tree_velocities(const Model& model) { return tree_coordinates(model, false); }
std::vector<TreeCoordinate> tree_positions(const Model& model) { return tree_coordinates(model, true); }

Presentation presentation(const Model& model, const Variable& variable) {
  const Words& words = words_of(variable);
  const bool sliding = slides(model, variable);
  Presentation result;
  result.quantity = sliding ? words.sliding : words.turning;
  for (const char* c = sliding ? words.sliding_text : words.turning_text; *c; ++c) {
    if (*c == '%')
      result.description += owner_of(model, variable);
    else if (*c == '$')
      result.description += words.labels[variable.element % words.label_count];
    else if (*c == '&')
      result.description += words.labels[variable.element / words.label_count];
    else
      result.description += *c;
  }
  if (words.adapt) words.adapt(model, variable, result);
  return result;
}

}  // namespace redysim
