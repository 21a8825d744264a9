#pragma once

#include <cmath>

#include "dynamics/elastic_force.hpp"
#include "model/actuator.hpp"

// The law of one actuator: input -> lag -> motor -> limits -> gear -> joint. Variables and parameters
// may be doubles or dual numbers. N is the gear ratio; torques refer to the joint side and are N times
// smaller on the motor side.
//   lag      T x' = input - x
//   motor    L i' = x - R i - k_t motor_qd, torque N k_t i
//   limits   of torque and speed
//   gear     rigid: motor_qd = N qd, the rotor is part of the joint's armature
//            elastic: J motor_qdd = (torque - gear torque) / N, which acts on the joint

namespace redysim {

// State of an actuator and of its joint. Entries that the actuator does not have are ignored.
template <class Scalar>
struct ActuatorPoint {
  Scalar input;              // N m or N; V for a DC motor
  Scalar q, qd;              // position and velocity of the joint
  Scalar motor_q, motor_qd;  // of the motor of an elastic gear, rad and rad/s
  Scalar current;            // A, if it has inductance
  Scalar lagged;             // the input after the lag
};

template <class Scalar>
struct ActuatorResponse {
  Scalar torque;                                // on the joint
  Scalar motor_qdd, current_rate, lagged_rate;  // slopes of the states
  Scalar power;       // motor power minus gear loss and the power of `torque` on the joint, W
  Scalar current;     // A
  Scalar saturation;  // part of the motor torque removed by the limits, 0 to 1
};

template <class Scalar, class Number>
Scalar onset_force(const Scalar& depth, const Number& width) {
  return depth > Scalar(0) ? SmoothOnset<Scalar>(depth, Scalar(width)).force() : Scalar(0);
}

// Law of an elastic gear: torque on the joint side as a function of the twist.
template <class Number>
ElasticLawOf<Number> gear_law(const ActuatorOf<Number>& gear) {
  return {gear.stiffness, gear.damping, 0.5 * gear.backlash, gear.backlash_width};
}

// Exact up to half the width below the limit, twice continuously differentiable, never above the limit.
template <class Scalar, class Number>
Scalar saturated_torque(const ActuatorOf<Number>& motor, const Scalar& torque) {
  if (!motor.limits_torque()) return torque;
  const Number width = motor.torque_limit_width, least = motor.torque_limit - 0.5 * width;
  return torque - onset_force(Scalar(torque - least), width) + onset_force(Scalar(-torque - least), width);
}

// The driving torque decreases to zero before the speed limit; braking torque is unchanged.
template <class Scalar, class Number>
Scalar torque_at_speed(const ActuatorOf<Number>& motor, const Scalar& torque, const Scalar& speed) {
  if (!motor.limits_speed() || !(torque * speed > Scalar(0))) return torque;
  const Scalar size = speed < Scalar(0) ? -speed : speed;
  const Scalar u = (size - (motor.speed_limit - motor.speed_limit_width)) / motor.speed_limit_width;
  if (!(u > Scalar(0))) return torque;
  if (!(u < Scalar(1))) return Scalar(0);
  return torque * (1.0 - u * u * u * (10.0 - u * (15.0 - 6.0 * u)));
}

// Torque at rest under a constant input.
template <class Scalar, class Number>
Scalar torque_at_rest(const ActuatorOf<Number>& actuator, const Scalar& input) {
  const Number gain = actuator.is_electric()
                          ? Number(actuator.gear_ratio * actuator.torque_constant / actuator.resistance)
                          : Number(1);
  return saturated_torque(actuator, Scalar(gain * input));
}

// The motor before its limits, on the joint side: speed, voltage over resistance and inductance, current,
// torque.
template <class Scalar>
struct MotorPoint {
  Scalar speed, drop{0}, current{0}, wanted;

  template <class Number>
  MotorPoint(const ActuatorOf<Number>& of, const ActuatorPoint<Scalar>& at)
      : speed(of.is_elastic() ? Scalar(at.motor_qd / of.gear_ratio) : at.qd),
        wanted(of.lags() ? at.lagged : at.input) {
    if (!of.is_electric()) return;
    drop = wanted - of.torque_constant * of.gear_ratio * speed;
    current = of.has_inductance() ? at.current : Scalar(drop / of.resistance);
    wanted = of.gear_ratio * of.torque_constant * current;
  }
};

// Index of the region between the corners of the torque and speed limits.
inline unsigned limit_region(const Actuator& of, const ActuatorPoint<double>& at) {
  const MotorPoint<double> motor(of, at);
  const double speed_onset = of.speed_limit - of.speed_limit_width;
  const unsigned torque =
                     onset_region(std::fabs(motor.wanted) - (of.torque_limit - 0.5 * of.torque_limit_width),
                                  of.torque_limit_width),
                 speed = onset_region(std::fabs(motor.speed) - speed_onset, of.speed_limit_width),
                 driven = speed > 0 && motor.wanted * motor.speed > 0 ? 1 : 0;
  return (3 * torque + speed) * 2 + driven;
}

template <class Scalar, class Number>
ActuatorResponse<Scalar> respond(const ActuatorOf<Number>& actuator, const ActuatorPoint<Scalar>& at) {
  ActuatorResponse<Scalar> response{};
  const double N = actuator.gear_ratio;
  if (actuator.lags()) response.lagged_rate = (at.input - at.lagged) / actuator.time_constant;
  const MotorPoint<Scalar> motor(actuator, at);
  const Scalar &speed = motor.speed, &wanted = motor.wanted;
  response.current = motor.current;
  if (actuator.has_inductance())
    response.current_rate = (motor.drop - actuator.resistance * at.current) / actuator.inductance;
  const Scalar driving = torque_at_speed(actuator, saturated_torque(actuator, wanted), speed);
  if (wanted != Scalar(0)) response.saturation = Scalar(1) - driving / wanted;
  response.torque = driving;
  if (!actuator.is_elastic()) return response;
  const Scalar rate = speed - at.qd;
  const ElasticForce<Scalar> gear(gear_law(actuator), Scalar(at.motor_q / N - at.q), rate);
  response.torque = gear.sum();
  response.motor_qdd = (driving - response.torque) / (N * actuator.rotor_inertia);
  response.power = driving * speed + gear.loss - response.torque * at.qd;
  return response;
}

}  // namespace redysim
