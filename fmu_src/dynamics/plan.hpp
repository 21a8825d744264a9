#pragma once

#include <type_traits>
#include <vector>

#include "dynamics/contact/contact_plan.hpp"
#include "dynamics/elastic_force.hpp"
#include "dynamics/loops/cluster_plan.hpp"
#include "dynamics/pose_plan.hpp"
#include "dynamics/rotor.hpp"
#include "math/spatial.hpp"
#include "model/dh.hpp"
#include "model/features.hpp"
#include "model/parameters.hpp"

// The model in the form required by the recursions: fixed links merged into their carriers, constant geometry
// reduced to the necessary operations, loops grouped into clusters that share no joint.

namespace redysim {

// Kinds of Rx(alpha); a right angle is a signed permutation.
enum class Twist { none, plus_90, minus_90, general };

// Non-zero parts of a joint's motion subspace S (dynamics/motion_subspace.hpp).
enum class Subspace : unsigned char { rotation, translation, helix };

// One moving joint and the body it carries. Parents have smaller indices.
struct JointStructure {
  int parent = ground;  // joint index of the carrier
  int link = 0;         // index into Model::links
  Subspace subspace = Subspace::rotation;
  double pitch = 0;                // helix: linear part of S, m/rad
  bool prescribed = false;         // acceleration given, force unknown
  bool of_ball = false;            // chart, z, x or y joint of a spherical joint (dynamics/ball.hpp)
  bool branch = false;             // gamma, b or aside present
  bool has_offset = false;         // d present, or a translation along z
  bool has_passive_force = false;  // stiffness, damping, friction or stops present
  bool has_resistance = false;     // friction or stops present
  bool has_friction = false;
  bool has_stops = false;
  bool axis_free = true;  // rotation without armature: no moment about z is transmitted
  Twist twist = Twist::none;
};

template <class Scalar>
struct JointPlan : JointStructure {
  // Rz(gamma) T(0, aside, b) Rx(alpha) Tx(a) Rz(theta) Tz(d); if axes are nearly parallel, aside replaces b
  // and d
  Scalar cos_gamma = 1, sin_gamma = 0, b = 0, aside = 0;
  Scalar cos_alpha = 1, sin_alpha = 0, a = 0;
  Scalar theta = 0, cos_theta = 1, sin_theta = 0, d = 0;
  // parameters
  RigidInertia<Scalar> inertia;
  ArticulatedInertia<Scalar> rigid;  // `inertia` as an articulated inertia
  Scalar stiffness = 0, rest = 0, damping = 0, armature = 0;

  // Copies the geometry without the parameters.
  template <class Other>
  JointPlan<Other> cast() const {
    JointPlan<Other> to;
    static_cast<JointStructure&>(to) = static_cast<const JointStructure&>(*this);
    to.cos_gamma = cos_gamma;
    to.sin_gamma = sin_gamma;
    to.b = b;
    to.aside = aside;
    to.cos_alpha = cos_alpha;
    to.sin_alpha = sin_alpha;
    to.a = a;
    to.theta = theta;
    to.cos_theta = cos_theta;
    to.sin_theta = sin_theta;
    to.d = d;
    return to;
  }
};

// Dry friction and stops of one joint (dynamics/joint_force.hpp).
template <class Scalar>
struct Resistance {
  Scalar friction = 0, excess = 0, per_velocity = 0;  // excess: maximum minus sliding friction
  Scalar lower = 0, upper = 0, stiffness = 0, damping = 0, width = 1;
};

// A spring-damper between two points of two bodies; points in body frames.
template <class Scalar>
struct SpringPlan {
  int body_a = ground, body_b = ground;
  int entry_a = ground, entry_b = ground;  // indices into Workspace::ground
  Vec3<Scalar> point_a, point_b;
  Scalar stiffness = 0, damping = 0, rest_length = 0;

  template <class Other>
  SpringPlan<Other> cast() const {
    return {body_a,
            body_b,
            entry_a,
            entry_b,
            point_a.template cast<Other>(),
            point_b.template cast<Other>(),
            stiffness,
            damping,
            rest_length};
  }
};

// dynamics/elastic_coupling.hpp
struct ElasticCouplingPlan : CoupledJoints, ElasticLaw {};

// A spring-damper in six directions, along the axes of frame a (dynamics/bushing.hpp); frames a and b are
// given in the body frames.
template <class Scalar>
struct BushingPlan {
  int body_a = ground, body_b = ground;
  int entry_a = ground, entry_b = ground;  // indices into Workspace::ground
  Vec3<Scalar> point_a, point_b;
  Mat3<Scalar> rotation_a, rotation_b;
  Vec3<Scalar> stiffness, turning_stiffness, damping, turning_damping;

  template <class Other>
  BushingPlan<Other> cast() const {
    return {body_a,
            body_b,
            entry_a,
            entry_b,
            point_a.template cast<Other>(),
            point_b.template cast<Other>(),
            rotation_a.template cast<Other>(),
            rotation_b.template cast<Other>(),
            stiffness.template cast<Other>(),
            turning_stiffness.template cast<Other>(),
            damping.template cast<Other>(),
            turning_damping.template cast<Other>()};
  }
};

// A frame with force inputs: moment and force at its origin, in its own axes or in ground axes.
template <class Scalar>
struct PortPlan {
  int frame = 0;  // index into Model::frames
  int body = ground;
  int entry = ground;  // index into Workspace::ground, if in ground axes
  bool in_ground_axes = true;
  Mat3<Scalar> rotation;  // rotation of the frame in the body
  Vec3<Scalar> position;

  template <class Other>
  PortPlan<Other> cast() const {
    return {
        frame, body, entry, in_ground_axes, rotation.template cast<Other>(), position.template cast<Other>()};
  }
};

// The parts of a plan that do not depend on the scalar type.
struct PlanStructure {
  int nv = 0;
  int prescribed_count = 0;
  bool plain = false;      // no constraints, forces between bodies, ports or prescribed joints
  std::vector<int> balls;  // chart joint of each spherical joint; its z, x and y joints follow it
  std::vector<CouplingPlan> couplings;  // rigid
  std::vector<double> joint_units;      // 1 rad, or the scale of a prismatic joint, m; empty without clusters
  std::vector<std::vector<MultiplierPart>> coupling_multipliers;  // per coupling of the model
  std::vector<ElasticCouplingPlan> elastic_couplings;
  std::vector<RotorPlan> rotors;  // rotors with gyroscopic moments
  std::vector<ClusterPlan> clusters;
  std::vector<EliminationStep> elimination;  // leaves to root; empty for an open tree
  std::vector<PoseStep> poses;               // for bodies with loops or forces between bodies, parents first
  int pose_count = 0;                        // number of entries of Workspace::ground
  // Per link of the model: the joint that carries it (ground if fixed to it), and the link's frame in the
  // body frame of that joint.
  std::vector<int> carrier;
  std::vector<Pose> frame_in_carrier;
};

template <class Scalar>
struct Plan : PlanStructure {
  Plan() = default;
  Plan(const Model& model, const Parameters<Scalar>& parameters);
  explicit Plan(const Model& model) : Plan(model, parameters_of(model).cast<Scalar>()) {}
  // A plan with another scalar type, without parameters of joints and without fronts.
  template <class Other>
  explicit Plan(const Plan<Other>& plan);

  // Applies changed parameters; does not allocate. Friction and stops are ignored unless may_resist(model).
  void update(const Parameters<Scalar>& parameters);

  Vec3<Scalar> gravity = Vec3<Scalar>::Zero();
  Vec3<Scalar> grounded = Vec3<Scalar>::Zero();  // first moment, kg m, of links fixed to the ground
  // Position, m, of the first joint of a tree (smallest_tree). Positions are relative to this point, which
  // preserves their accuracy far from the origin of the ground frame.
  Vec3<Scalar> origin = Vec3<Scalar>::Zero();
  std::vector<JointPlan<Scalar>> joints;
  std::vector<Resistance<Scalar>> resistances;  // per joint; empty if no joint has friction or stops
  std::vector<SpringPlan<Scalar>> springs;
  std::vector<BushingPlan<Scalar>> bushings;
  std::vector<ContactPair<Scalar>> contact_pairs;
  std::vector<ContactLaw<Scalar>> contact_laws;  // per contact of the model
  std::vector<PortPlan<Scalar>> ports;
  std::vector<LoopPlan<Scalar>> loops;
  std::vector<FrontPlan> fronts;
  std::vector<EliminationStep>
      elimination_by_fronts;  // with fronts instead of split clusters; empty without fronts

  // Parts that a recursion may skip; constant in a library built without them.
  bool is_open() const { return is_plain() || !has_constraints(); }
  bool has_constraints() const { return features::loops && !clusters.empty(); }  // loops, rigid couplings
  // double only: exact derivatives are needed rarely, and the library stays small
  static constexpr bool may_have_fronts = features::loops && std::is_same_v<Scalar, double>;
  bool has_fronts() const { return may_have_fronts && !fronts.empty(); }
  static constexpr bool is_front(const EliminationStep& step) {
    return may_have_fronts && step.kind == EliminationStep::Kind::front;
  }
  bool has_springs() const { return features::springs && !springs.empty(); }
  bool has_elastic_couplings() const { return features::springs && !elastic_couplings.empty(); }
  static constexpr bool may_have_bushings =
      features::bushings && (std::is_same_v<Scalar, double> || std::is_same_v<Scalar, Dual>);
  bool has_bushings() const { return may_have_bushings && !bushings.empty(); }
  // not in straight-line code
  static constexpr bool may_have_contacts =
      features::contact && (std::is_same_v<Scalar, double> || std::is_same_v<Scalar, Dual>);
  bool has_contacts() const { return may_have_contacts && !contact_pairs.empty(); }
  bool has_ports() const { return features::ports && !ports.empty(); }
  bool has_motion() const { return features::motion && prescribed_count > 0; }
  bool is_plain() const {
    return plain || !(features::loops || features::springs || features::bushings || features::contact ||
                      features::ports || features::motion);
  }
  bool has_poses() const {
    return (features::loops || features::springs || features::bushings || features::contact ||
            features::ports) &&
           !poses.empty();
  }

 private:
  void update_rotors();
};

template <>
Plan<double>::Plan(const Model& model, const Parameters<double>& parameters);

}  // namespace redysim
