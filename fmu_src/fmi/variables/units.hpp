#pragma once

// Units and quantities of the XML. Used by `describe` only.

namespace redysim {

// A unit as exponents of the SI base units, and its display unit (null: the same).
struct Unit {
  const char* name;
  int kg, m, s, rad;
  const char* display_name = nullptr;
  double display_factor = 1;  // display value = factor * value
  int ampere = 0;
};

// A unit (null: dimensionless) and the Modelica name of the quantity (null: none).
struct Quantity {
  const Unit* unit = nullptr;
  const char* name = nullptr;
};

namespace units {
inline constexpr double degrees = 57.295779513082323;  // per radian
inline constexpr Unit radian{"rad", 0, 0, 0, 1, "deg", degrees};
inline constexpr Unit radian_per_second{"rad/s", 0, 0, -1, 1, "deg/s", degrees};
inline constexpr Unit radian_per_second2{"rad/s2", 0, 0, -2, 1, "deg/s2", degrees};
inline constexpr Unit metre{"m", 0, 1, 0, 0};
inline constexpr Unit metre_per_second{"m/s", 0, 1, -1, 0};
inline constexpr Unit metre_per_second2{"m/s2", 0, 1, -2, 0};
inline constexpr Unit newton_metre{"N.m", 1, 2, -2, 0};
inline constexpr Unit newton{"N", 1, 1, -2, 0};
inline constexpr Unit torsional_stiffness{"N.m/rad", 1, 2, -2, -1};
inline constexpr Unit torsional_damping{"N.m.s/rad", 1, 2, -1, -1};
inline constexpr Unit linear_stiffness{"N/m", 1, 0, -2, 0};
inline constexpr Unit linear_damping{"N.s/m", 1, 0, -1, 0};
inline constexpr Unit kilogram{"kg", 1, 0, 0, 0};
inline constexpr Unit kilogram_metre{"kg.m", 1, 1, 0, 0};
inline constexpr Unit kilogram_metre2{"kg.m2", 1, 2, 0, 0};
inline constexpr Unit joule{"J", 1, 2, -2, 0};
inline constexpr Unit watt{"W", 1, 2, -3, 0};
inline constexpr Unit newton_second{"N.s", 1, 1, -1, 0};
inline constexpr Unit newton_metre_second{"N.m.s", 1, 2, -1, 0};
inline constexpr Unit volt{"V", 1, 2, -3, 0, nullptr, 1, -1};
inline constexpr Unit ampere{"A", 0, 0, 0, 0, nullptr, 1, 1};
inline constexpr Unit ohm{"Ohm", 1, 2, -3, 0, nullptr, 1, -2};
inline constexpr Unit henry{"H", 1, 2, -2, 0, nullptr, 1, -2};
inline constexpr Unit newton_metre_per_ampere{"N.m/A", 1, 2, -2, 0, nullptr, 1, -1};
inline constexpr Unit per_second{"1/s", 0, 0, -1, 0};
inline constexpr Unit per_second2{"1/s2", 0, 0, -2, 0};
inline constexpr Unit second{"s", 0, 0, 1, 0};
inline constexpr Unit second_per_radian{"s/rad", 0, 0, 1, -1};
inline constexpr Unit second_per_metre{"s/m", 0, -1, 1, 0};
}  // namespace units

namespace quantity {
inline constexpr Quantity none;
inline constexpr Quantity angle{&units::radian, "Angle"};
inline constexpr Quantity angular_velocity{&units::radian_per_second, "AngularVelocity"};
inline constexpr Quantity angular_acceleration{&units::radian_per_second2, "AngularAcceleration"};
inline constexpr Quantity position{&units::metre, "Position"};
inline constexpr Quantity length{&units::metre, "Length"};
inline constexpr Quantity velocity{&units::metre_per_second, "Velocity"};
inline constexpr Quantity acceleration{&units::metre_per_second2, "Acceleration"};
inline constexpr Quantity torque{&units::newton_metre, "Torque"};
inline constexpr Quantity force{&units::newton, "Force"};
inline constexpr Quantity torsional_stiffness{&units::torsional_stiffness, "Stiffness"};
inline constexpr Quantity linear_stiffness{&units::linear_stiffness, "Stiffness"};
inline constexpr Quantity torsional_damping{&units::torsional_damping, "Damping"};
inline constexpr Quantity linear_damping{&units::linear_damping, "Damping"};
inline constexpr Quantity moment_of_inertia{&units::kilogram_metre2, "MomentOfInertia"};
inline constexpr Quantity mass{&units::kilogram, "Mass"};
inline constexpr Quantity energy{&units::joule, "Energy"};
inline constexpr Quantity power{&units::watt, "Power"};
inline constexpr Quantity momentum{&units::newton_second, "Momentum"};
inline constexpr Quantity angular_momentum{&units::newton_metre_second, "AngularMomentum"};
inline constexpr Quantity voltage{&units::volt, "Voltage"};
inline constexpr Quantity current{&units::ampere, "ElectricCurrent"};
inline constexpr Quantity resistance{&units::ohm, "Resistance"};
inline constexpr Quantity inductance{&units::henry, "Inductance"};
inline constexpr Quantity torque_constant{&units::newton_metre_per_ampere, "ElectricalTorqueConstant"};
inline constexpr Quantity duration{&units::second, "Time"};
}  // namespace quantity

}  // namespace redysim
