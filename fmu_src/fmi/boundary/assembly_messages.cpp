#include "fmi/boundary/assembly_messages.hpp"

#include <cmath>

#include "dynamics/motion_subspace.hpp"
#include "model/number.hpp"

namespace redysim {

namespace {

constexpr double typed_precision = 1e-9;  // rad or m, of start values in a model file

std::string three_digits(double number) {
  if (number == 0) return "0";
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(number))) - 2);
  return rounded(std::round(number / unit) * unit);
}

// "26.1 mm", "0.5 m", "1.06 rad"
std::string quantity(double size, bool in_angle) {
  if (in_angle) return three_digits(size) + " rad";
  return std::abs(size) < 0.1 ? three_digits(1000 * size) + " mm" : three_digits(size) + " m";
}

std::string quantity(const Assembly::Residual& residual) {
  return quantity(residual.size, residual.in_angle);
}

// "joint2 by -0.262 rad, slider by 10 mm": changes above the precision of start values. A spherical joint is
// listed as a whole.
std::string changes(const Model& model, const Plan<double>& plan, const std::vector<double>& change,
                    const std::vector<double>& ball_change, const char* per) {
  std::string text;
  const auto add = [&](const std::string& name, double by, bool in_angle) {
    if (std::abs(by) > typed_precision)
      text += (text.empty() ? "" : ", ") + name + " by " + quantity(by, in_angle) + per;
  };
  std::size_t ball = 0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (!plan.joints[i].of_ball)
      add(model.links[plan.joints[i].link].joint.name, change[i], turns(plan.joints[i]));
    else if (ball < plan.balls.size() && plan.balls[ball] == static_cast<int>(i)) {
      add(model.balls[ball].name, ball_change[ball], true);
      ++ball;
    }
  }
  return text;
}

// Name of a joint in the model file: "wrist" for "wrist[2]", a part of a joint with several degrees of
// freedom.
std::string given_name(const Model& model, const Plan<double>& plan, int joint) {
  const std::string& name = model.links[plan.joints[joint].link].joint.name;
  return name.substr(0, name.find('['));
}

std::string count(int number, const std::string& one, const std::string& many) {
  return std::to_string(number) + " " + (number == 1 ? one : many);
}

std::string constraints(const Model& model) {
  return model.couplings.empty() ? "loop constraints" : "constraints";
}

}  // namespace

ConstraintPlace constraint_at(const Model& model, int constraint) {
  const std::size_t index = static_cast<std::size_t>(std::max(constraint, 0)), loops = model.loops.size();
  if (index < loops) {
    const Loop& loop = model.loops[index];
    return {"loop '" + loop.name + "'", loop.line, loop.column};
  }
  const Coupling& coupling = model.couplings[index - loops];
  return {"coupling '" + coupling.name + "'", coupling.line, coupling.column};
}

std::string failure(const Model& model, const Assembly& assembly) {
  if (assembly.closed && assembly.consistent) return {};
  const std::string at = constraint_at(model, assembly.constraint).label + ": ", them = constraints(model);
  if (!assembly.closed)
    return at + "no configuration satisfies the " + them + "; smallest residual " + quantity(assembly.gap) +
           (assembly.nearly_closed ? ": do angles or lengths lack digits?" : "");
  return at + "no velocities satisfy the " + them +
         " while held and prescribed joints keep theirs; smallest residual " + quantity(assembly.rate) + "/s";
}

std::string failure(const Model& model, const Plan<double>& plan, const Rest& rest) {
  const std::string option = "start = \"equilibrium\"";
  if (rest.end == Rest::End::found) return {};
  const std::string joint = "joint '" + given_name(model, plan, rest.joint) + "'";
  if (rest.end == Rest::End::none_near)
    return option + " found no rest configuration near the start positions; " + joint +
           " still accelerates by " + rounded(rest.acceleration) + " " +
           (turns(plan.joints[rest.joint]) ? "rad" : "m") + "/s^2";
  return option + (rest.end == Rest::End::motion_moves ? " needs prescribed motions" : " needs joints") +
         " that start at rest; " + joint + " starts with a velocity";
}

std::string misfit(const Model& model, int constraint, const Assembly::Residual& acceleration) {
  return constraint_at(model, constraint).label + ": prescribed accelerations violate its constraints by " +
         quantity(acceleration) + "/s^2";
}

std::vector<std::string> corrections(const Model& model, const Plan<double>& plan, const Assembly& assembly) {
  std::vector<std::string> sentences;
  const std::string moved = changes(model, plan, assembly.moved, assembly.ball_moved, ""),
                    sped = changes(model, plan, assembly.sped, assembly.ball_sped, "/s");
  if (!moved.empty())
    sentences.push_back("initial configuration violates the " + constraints(model) + " by " +
                        quantity(assembly.gap_before) + "; corrected: " + moved);
  if (sped.empty()) return sentences;
  const bool on_no_branch = assembly.rate_before.size < typed_precision;
  sentences.push_back((on_no_branch
                           ? "initial velocities lead off the branches of this singular configuration"
                           : "initial velocities violate the " + constraints(model) + " by " +
                                 quantity(assembly.rate_before) + "/s") +
                      "; corrected: " + sped);
  return sentences;
}

std::string sentence(const Freedom& freedom) {
  std::string text = count(freedom.motions, "motion", "motions") + " for " +
                     count(freedom.system, "degree of freedom", "degrees of freedom") + ": ";
  if (freedom.surplus == 0 && freedom.left == 0) return text + "fully driven";
  if (freedom.surplus > 0)
    text += count(freedom.surplus, "motion", "motions") +
            " more than degrees of freedom, they must be consistent with the loops";
  if (freedom.surplus > 0 && freedom.left > 0) text += "; ";
  if (freedom.left > 0)
    text += std::to_string(freedom.left) + (freedom.left == 1 ? " is not prescribed and is integrated"
                                                              : " are not prescribed and are integrated");
  return text;
}

std::string singular_sentence(const Model& model, const Plan<double>& plan, int joint, const char* where) {
  const std::string name = given_name(model, plan, joint);
  const bool part = name != model.links[plan.joints[joint].link].joint.name;
  return "joint '" + name + "': the mass matrix is singular" + where +
         ", because this joint and those it carries can move without moving mass or inertia; "
         "give its link mass or inertia" +
         (part ? "" : ", or the joint an armature");
}

}  // namespace redysim
