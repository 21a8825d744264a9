#pragma once

#include <array>
#include <string>
#include <vector>

#include "math/vec3.hpp"
#include "model/actuator.hpp"
#include "model/contact.hpp"
#include "model/controller.hpp"
#include "model/joint.hpp"
#include "model/output_groups.hpp"
#include "model/trajectory.hpp"

// The multibody system as described in the model file: names, links, loops, forces and settings in SI units
// and radians, checked, parents before children, immutable after reading.
// Symbols and conventions: docs/notation.md.

namespace redysim {

inline constexpr int ground = -1;  // index of the fixed base wherever a link index is expected

// A rigid body: mass in kg, com in m in the link frame, inertia in kg m^2 about the com in link axes
// as (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), products with the sign of the matrix entry.
template <class Scalar>
struct LinkParameters {
  Scalar mass = 0;
  Vec3<Scalar> com = Vec3<Scalar>::Zero();
  std::array<Scalar, 6> inertia{};

  template <class Other>
  LinkParameters<Other> cast() const {
    const auto& I = inertia;
    return {mass, com.template cast<Other>(), {I[0], I[1], I[2], I[3], I[4], I[5]}};
  }
};

struct Link : LinkParameters<double> {
  std::string name;
  int parent = ground;
  Joint joint;
  int line = 0, column = 0;  // in the model file; 0: not from a file
};

// Start state of a spherical joint: unit quaternion (w, x, y, z; from link axes to the joint's DH frame) and
// angular velocity in link axes, rad/s.
template <class Scalar>
struct BallStart {
  std::array<Scalar, 4> quaternion{1, 0, 0, 0};
  std::array<Scalar, 3> omega{};

  template <class Other>
  BallStart<Other> cast() const {
    const auto& p = quaternion;
    return {{p[0], p[1], p[2], p[3]}, {omega[0], omega[1], omega[2]}};
  }
};

// A spherical joint in the model: four revolute joints on consecutive links. The first, `chart`, is about x
// and set to 0 or 90 deg by the simulation; the others are about z, x and y.
struct Ball : BallStart<double> {
  std::string name;  // of the spherical joint
  int chart_link = 0;
  bool driven = true;  // has a torque input, in link axes
};

// `point` constrains only the given directions of the ground frame; the other types are named after the
// joint.
enum class LoopType { point, spherical, revolute, prismatic, cylindrical, universal, fixed };

// A cut joint between link a and link b (or ground). Points are in m in the frame of the link. `axis` is the
// axis of the joint, `x` a second direction that defines the rotation about it, each in the frame of its
// link. They coincide in the closed loop. For `universal`, axis_a and axis_b are the two axes of the cross
// and stay perpendicular.
struct Loop {
  std::string name;
  LoopType type = LoopType::spherical;
  int link_a = ground, link_b = ground;
  Vec3<double> point_a = Vec3<double>::Zero(), point_b = Vec3<double>::Zero();
  Vec3<double> axis_a = Vec3<double>::UnitZ(), axis_b = Vec3<double>::UnitZ();
  Vec3<double> x_a = Vec3<double>::UnitX(), x_b = Vec3<double>::UnitX();
  std::vector<Vec3<double>> directions;  // ground frame, unit length; type point only
  int line = 0, column = 0;              // in the model file; 0: not from a file
};

// A spring-damper with tension k (l - rest_length) + c dl/dt along the line between two points.
struct SpringDamper {
  std::string name;
  int link_a = ground, link_b = ground;
  Vec3<double> point_a = Vec3<double>::Zero(), point_b = Vec3<double>::Zero();
  double stiffness = 0, damping = 0, rest_length = 0;
};

// y = sum of ratios[i] q[i] - offset, over joints with one DOF each, q in rad or m. A rigid coupling enforces
// y = 0. An elastic coupling has the force F(y, y') and acts on each joint with -ratios[i] F
// (dynamics/elastic_coupling.hpp).
struct Coupling {
  std::string name;
  std::vector<int> links;  // the links of the coupled joints
  std::vector<double> ratios;
  double offset = 0;
  double stiffness = 0;  // relative to y; 0: rigid
  double damping = 0, backlash = 0, width = 0;
  int line = 0, column = 0;  // in the model file; 0: not from a file

  bool rigid() const { return stiffness == 0; }
};

// A spring-damper in all six directions between frame a and frame b, along the axes of frame a
// (dynamics/bushing.hpp). The columns of a rotation are the axes of the frame in the frame of its link.
struct Bushing {
  std::string name;
  int link_a = ground, link_b = ground;
  Vec3<double> point_a = Vec3<double>::Zero(), point_b = Vec3<double>::Zero();
  Mat3<double> rotation_a = Mat3<double>::Identity(), rotation_b = Mat3<double>::Identity();
  Vec3<double> stiffness = Vec3<double>::Zero(), turning_stiffness = Vec3<double>::Zero();
  Vec3<double> damping = Vec3<double>::Zero(), turning_damping = Vec3<double>::Zero();
};

// A named frame on a link, with optional outputs of its motion and optional inputs for force and torque.
struct Frame {
  enum class Port { none, ground_axes, frame_axes };
  std::string name;
  int link = ground;
  Vec3<double> position = Vec3<double>::Zero();      // m, in the link's frame
  Mat3<double> rotation = Mat3<double>::Identity();  // columns: the frame's axes in the link's frame
  bool pose = true;                                  // outputs position and quaternion
  bool rotation_matrix = false;
  bool velocity = false;      // outputs velocity and angular_velocity
  bool acceleration = false;  // outputs acceleration and angular_acceleration
  bool imu = false;           // outputs proper_acceleration and angular_rate
  bool wrench = false;        // outputs sensed_force and sensed_torque; requires a fixed joint
  bool power = false;         // output power of the input force and torque
  bool jacobian = false, jacobian_rate = false, inverse_inertia = false;
  Port port = Port::none;  // inputs force and torque
};

enum class SolverMethod { automatic, erk, adams, bdf, dirk, exponential, taylor };

struct SolverSettings {
  SolverMethod method = SolverMethod::automatic;
  double rtol = 1e-6;
  double atol = 1e-8;
  double max_step = 0;      // s; 0: unlimited
  double max_rhs = 0;       // maximum right-hand sides per communication step; 0: unlimited
  double target_error = 0;  // m or rad; the packager selects rtol for it; 0: none or rtol is given

  bool same_steps(const SolverSettings& other) const {
    return method == other.method && rtol == other.rtol && atol == other.atol && max_step == other.max_step &&
           max_rhs == other.max_rhs;
  }
};

// Output groups and settings of the FMU. Group names as in docs/model_file.md.
struct FmuSettings {
  OutputGroups outputs = OutputGroups::by_default();
  bool shows(OutputGroup group) const { return outputs.has(group); }
  std::vector<std::string> tunable;        // parameters that a master may change, such as "link3.mass"
  double stop_time = 1, step_size = 1e-3;  // default experiment, s
  static constexpr const char* origin_fields[] = {"version", "author", "license", "copyright"};
  std::vector<std::string> origin;  // the texts of origin_fields; empty if not given
};

// Reference solution of `build-fmu report`.
struct ReportSettings {
  std::string reference;  // CSV file in the folder of the model file; empty: none
};

struct Model {
  std::string name;
  std::string description;
  Vec3<double> gravity = {0, 0, -9.81};  // m/s^2 in the ground frame
  bool starts_in_equilibrium = false;    // starts at the equilibrium near the start positions
  std::vector<Link> links;               // parent index < own index
  std::vector<Loop> loops;
  std::vector<Coupling> couplings;
  std::vector<SpringDamper> springs;
  std::vector<Bushing> bushings;
  std::vector<Contact> contacts;
  std::vector<Frame> frames;
  std::vector<Ball> balls;
  std::vector<Actuator> actuators;
  std::vector<Trajectory> trajectories;
  Controller controller;
  SolverSettings solver;
  FmuSettings fmu;
  ReportSettings report;

  // Whether loops or rigid couplings constrain the tree.
  bool has_constraints() const {
    for (const Coupling& coupling : couplings)
      if (coupling.rigid()) return true;
    return !loops.empty();
  }
};

}  // namespace redysim
