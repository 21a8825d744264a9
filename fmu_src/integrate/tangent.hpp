#pragma once

#include <vector>

#include "dynamics/assembly.hpp"
#include "integrate/control_tangent.hpp"
#include "integrate/system.hpp"
#include "math/dual.hpp"
#include "math/spatial.hpp"

namespace redysim {

// A System at one point with one direction of change, as dual numbers: values are the point's, derivatives
// the direction's, and what follows is exact to first order. Made when a master first asks for derivatives.
class Tangent {
 public:
  Tangent(const Model& model, const System& system);

  // Goes to (time, y) with no direction; parameters of `model`. The directions of known things are then set
  // by the caller: of q, qd (joints of one freedom), force, ball_*, the parameters in plans() and control().
  void go_to(const Model& model, System& system, double time, const double* y);

  // Quaternion (any length), angular velocity and torque of a spherical joint: directions.
  struct BallChange {
    double quaternion[4] = {}, omega[3] = {}, torque[3] = {};
  };
  std::vector<Dual> q, qd, force;  // of all joints; force: as System::forces()
  std::vector<BallChange> balls;
  std::vector<Plan<Dual>*> plans();  // in which a parameter has its direction: the plant's, the controller's
  ControlTangent* control() { return features::control ? control_.get() : nullptr; }  // null: no such thing
  void change_mass(int body, const Pose& frame, const Vec3<double>& com, double mass, double d_mass,
                   const Vec3<double>& d_com, const Mat3<double>& d_inertia);

  // The directions of q and qd where those of prescribed joints jump by what stands in them: the others
  // follow as System::follow_jumps lets them, and loops stay closed.
  void follow_jumps(System& system, double time, const double* y);

  // The directions of start values become those of the assembled start.
  void follow_assembly(const Model& model, const Assembly& assembly);

  // All directions by time: inputs go on with their slopes.
  void go_with_time(System& system, double time, const double* y);

  // What follows; false: not finite. Quantities below are then those of the direction.
  bool evaluate();
  std::vector<Dual> qdd, drive;
  Dual power;                     // of drives, dampers and ports
  std::vector<Dual> multipliers;  // per loop row
  Dual kinetic_energy(), potential_energy();
  Force<Dual> momentum();
  GroundState<Dual> body(int index);
  struct BallMotion {
    Vec3<Dual> omega, alpha;
    Vec3<double> turn;  // of the link, in its axes
  };
  BallMotion ball(int index) const;

 private:
  void set_balls();

  Plan<Dual> plan_;
  Workspace<Dual> workspace_;
  std::vector<BallAngles> angles_;
  std::vector<Vec3<double>> ball_omega_, ball_torque_, ball_turn_;
  std::vector<Eigen::Vector4d> ball_quaternion_;
  std::vector<BallAnglesOf<Dual>> moved_;
  bool with_time_ = false;
  std::unique_ptr<ControlTangent> control_;
};

}  // namespace redysim
