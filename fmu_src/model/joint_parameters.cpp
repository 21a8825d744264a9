#include "model/joint_parameters.hpp"

#include "model/number.hpp"

namespace redysim {
namespace {

constexpr double degree = 3.14159265358979323846 / 180;

double unit_of(const JointParameter& parameter, const Joint& joint, bool degrees) {
  const bool angle = joint.type != JointType::prismatic && parameter.kind != JointParameter::Kind::other;
  return degrees && angle ? degree : 1;
}

}  // namespace

void read_joint_parameters(Section& section, Joint& joint, bool degrees) {
  for (const JointParameter& parameter : joint_parameters) {
    const double number = section.number(parameter.name, joint.*parameter.value, parameter.bound);
    if (section.has(parameter.name)) joint.*parameter.value = number * unit_of(parameter, joint, degrees);
  }
}

void read_joint_parameters(Section& section, std::vector<Joint>& freedoms, bool degrees) {
  for (const JointParameter& parameter : joint_parameters) {
    const std::string name = parameter.name;
    std::vector<double> given;
    if (!section.numbers(name, given)) continue;
    if (given.size() != freedoms.size()) {
      section.error(name, name + " must be " + std::to_string(freedoms.size()) + " numbers, got " +
                              std::to_string(given.size()));
      continue;
    }
    for (std::size_t k = 0; k < given.size(); ++k)
      if (section.within(name, given[k], parameter.bound))
        freedoms[k].*parameter.value = given[k] * unit_of(parameter, freedoms[k], degrees);
  }
}

}  // namespace redysim
