#include "integrate/actuator/actuators.hpp"

#include <algorithm>
#include <cmath>

namespace redysim {
namespace {

ActuatorResponse<double> response_at_rest(const Actuator& law, double input) {
  ActuatorResponse<double> response{};
  response.torque = torque_at_rest(law, input);
  return response;
}

// Depth beyond the backlash at which SmoothOnset gives this force (per stiffness).
double depth_of(double force, double width) {
  if (force >= 0.5 * width) return force + 0.5 * width;
  double low = 0, high = width;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (!(low < middle && middle < high)) return middle;
    (onset_force(middle, width) < force ? low : high) = middle;
  }
}

double twist_under(const Actuator& gear, double torque) {
  if (gear.backlash == 0) return torque / gear.stiffness;
  if (torque == 0) return 0;
  const double depth = depth_of(std::abs(torque) / gear.stiffness, gear.backlash_width);
  return std::copysign(0.5 * gear.backlash + depth, torque);
}

}  // namespace

Actuators::Actuators(const Model& model, const std::vector<int>& integrated,
                     const std::vector<int>& carrier) {
  for (std::size_t number = 0; number < model.actuators.size(); ++number) {
    const Actuator& law = model.actuators[number];
    const int joint = carrier[law.link];
    const auto found = std::find(integrated.begin(), integrated.end(), joint);
    if (!law.acts() || found == integrated.end()) continue;
    Placed& placed = list_.emplace_back();
    placed.law = law;
    placed.number = static_cast<int>(number);
    placed.joint = joint;
    placed.place = static_cast<int>(found - integrated.begin());
    if (law.is_elastic()) placed.motor = counts_.motors++;
    if (law.inductance > 0) placed.current = counts_.currents++;
    if (law.lags()) placed.lagged = counts_.lags++;
  }
  inputs_.resize(list_.size());
  responses_.resize(list_.size());
}

void Actuators::update(const Parameters<double>& parameters) {
  for (Placed& placed : list_) placed.law = parameters.actuators[placed.number];
}

int Actuators::at(int joint) const {
  for (std::size_t k = 0; k < list_.size(); ++k)
    if (list_[k].joint == joint) return static_cast<int>(k);
  return -1;
}

Actuators::Places Actuators::places(int index) const {
  const Placed& at = list_[index];
  const auto place = [](const Span<1>& span, int entry) { return entry < 0 ? -1 : span[entry]; };
  return {place(layout_.motor_q, at.motor), place(layout_.motor_qd, at.motor),
          place(layout_.current, at.current), place(layout_.lagged, at.lagged)};
}

void Actuators::apply(const double* y, double* forces) {
  for (int k = 0; k < size(); ++k) {
    const Placed& at = list_[k];
    inputs_[k] = forces[at.joint];
    responses_[k] =
        resting_ ? response_at_rest(at.law, inputs_[k])
                 : respond(at.law, point(k, y, y[layout_.q[at.place]], y[layout_.qd[at.place]], inputs_[k]));
    forces[at.joint] = responses_[k].torque;
  }
}

void Actuators::exchange_inputs(double* forces) {
  for (int k = 0; k < size(); ++k) std::swap(inputs_[k], forces[list_[k].joint]);
}

void Actuators::set_slopes(const double* y, double* ydot) const {
  for (int k = 0; k < size(); ++k) {
    const Places place = places(k);
    const ActuatorResponse<double>& response = responses_[k];
    if (place.motor_q >= 0) {
      ydot[place.motor_q] = resting_ ? 0 : y[place.motor_qd];
      ydot[place.motor_qd] = response.motor_qdd;
    }
    if (place.current >= 0) ydot[place.current] = response.current_rate;
    if (place.lagged >= 0) ydot[place.lagged] = response.lagged_rate;
  }
}

double Actuators::power() const {
  double sum = 0;
  for (const ActuatorResponse<double>& response : responses_) sum += response.power;
  return sum;
}

void Actuators::set_scales(int index, double of_joint, double response, double* scales) const {
  const Places place = places(index);
  const Actuator& of = law(index);
  const double N = std::abs(of.gear_ratio);
  const auto set = [&](int entry, double scale) {
    if (entry >= 0) scales[entry - layout_.motor_q.begin] = scale;
  };
  // at most 1 A, V, N m or N: they hardly move a heavy body, but are outputs
  const auto set_force = [&](int entry, double scale) { set(entry, scale > 0 ? std::min(scale, 1.0) : 1); };
  set(place.motor_q, N * of_joint);
  set(place.motor_qd, N * of_joint);
  const double per_ampere = N * of.torque_constant;  // torque on the joint per ampere
  set_force(place.current, of_joint * of.resistance / (of.inductance * response * per_ampere));
  set_force(place.lagged,
            of_joint / (of.time_constant * response) * (of.is_electric() ? of.resistance / per_ampere : 1));
}

void Actuators::set_start(double* y) const {
  for (int k = 0; k < size(); ++k) {
    const Placed& at = list_[k];
    const Places place = places(k);
    if (place.motor_q >= 0) {
      y[place.motor_q] = at.law.gear_ratio * y[layout_.q[at.place]];
      y[place.motor_qd] = at.law.gear_ratio * y[layout_.qd[at.place]];
    }
    if (place.current >= 0) y[place.current] = 0;
    if (place.lagged >= 0) y[place.lagged] = 0;
  }
}

void Actuators::set_rest(double* y) const {
  for (int k = 0; k < size(); ++k) {
    const Placed& at = list_[k];
    const Places place = places(k);
    if (place.motor_q >= 0) {
      const double twist = twist_under(at.law, responses_[k].torque);
      y[place.motor_q] = at.law.gear_ratio * (y[layout_.q[at.place]] + twist);
      y[place.motor_qd] = 0;
    }
    if (place.current >= 0) y[place.current] = inputs_[k] / at.law.resistance;
    if (place.lagged >= 0) y[place.lagged] = inputs_[k];
  }
}

ActuatorGradient gradient(const Actuator& law, const ActuatorPoint<double>& at, bool resting) {
  ActuatorGradient result;
  for (int entry = 0; entry < ActuatorGradient::entries; ++entry) {
    const auto with = [&](double value, ActuatorGradient::Entry own) { return Dual(value, own == entry); };
    using Entry = ActuatorGradient;
    const ActuatorPoint<Dual> point{with(at.input, Entry::input),
                                    with(at.q, Entry::q),
                                    with(at.qd, Entry::qd),
                                    with(at.motor_q, Entry::motor_q),
                                    with(at.motor_qd, Entry::motor_qd),
                                    with(at.current, Entry::current),
                                    with(at.lagged, Entry::lagged)};
    if (!resting) {
      result.by[entry] = respond(law, point);
      continue;
    }
    result.by[entry] = {};
    result.by[entry].torque = torque_at_rest(law, point.input);
  }
  return result;
}

}  // namespace redysim
