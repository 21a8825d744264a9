#include "dynamics/plan.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/loops/cluster_builder.hpp"
#include "math/dual.hpp"
#include "math/recorded.hpp"

namespace redysim {

namespace {

Twist twist_of(const Turn& alpha) {
  if (alpha.sine == 0 && alpha.cosine > 0) return Twist::none;
  if (alpha.cosine == 0) return alpha.sine > 0 ? Twist::plus_90 : Twist::minus_90;
  return Twist::general;
}

// DH parameters, and an offset along y of the axes after gamma.
struct Placement {
  DhParameters dh;
  double aside = 0;
};

// The common normal of nearly parallel axes can be far away. Shifting an inertia there and back loses
// accuracy in proportion to the square of that distance. `position`: of the child, in the parent's axes
// rotated by gamma.
Placement placement_of(DhParameters dh, const Vec3<double>& position) {
  constexpr double far = 8;
  if (!(std::max(std::abs(dh.b), std::abs(dh.d)) > far * position.lpNorm<Eigen::Infinity>())) return {dh, 0};
  dh.a = position.x();
  dh.b = position.z();
  dh.d = 0;
  return {dh, position.y()};
}

Placement placement_of(const DhParameters& dh) {
  return placement_of(dh, {dh.a, -dh.d * std::sin(dh.alpha), dh.b + dh.d * std::cos(dh.alpha)});
}

Placement placement_of(const Pose& pose) {
  const DhParameters dh = dh_of(pose);
  return placement_of(dh, Eigen::AngleAxisd(-dh.gamma, Vec3<double>::UnitZ()) * pose.position);
}

JointPlan<double> joint_plan(const Joint& joint, const Placement& placement, int parent, int link) {
  DhParameters dh = placement.dh;
  JointPlan<double> plan;
  plan.parent = parent;
  plan.link = link;
  plan.subspace = !slides(joint) ? Subspace::rotation
                  : turns(joint) ? Subspace::helix
                                 : Subspace::translation;
  plan.pitch = motion_subspace(joint).linear;
  plan.prescribed = is_prescribed(joint);
  const Turn alpha = turn_of(dh.alpha);
  plan.twist = twist_of(alpha);
  if (plan.twist == Twist::none) {
    // the z axes are parallel: offsets along them add up, and so do the angles if nothing lies between them
    dh.d += dh.b;
    dh.b = 0;
    if (dh.a == 0 && placement.aside == 0) {
      dh.theta += dh.gamma;
      dh.gamma = 0;
    }
  }
  plan.branch = dh.gamma != 0 || dh.b != 0 || placement.aside != 0;
  plan.has_offset = dh.d != 0 || slides(joint);
  const Turn gamma = turn_of(dh.gamma), theta = turn_of(dh.theta);
  plan.cos_gamma = gamma.cosine;
  plan.sin_gamma = gamma.sine;
  plan.b = dh.b;
  plan.aside = placement.aside;
  plan.cos_alpha = alpha.cosine;
  plan.sin_alpha = alpha.sine;
  plan.a = dh.a;
  plan.theta = dh.theta;
  plan.cos_theta = theta.cosine;
  plan.sin_theta = theta.sine;
  plan.d = dh.d;
  return plan;
}

// Inertia of one link about the origin and in the axes of its carrier. `frame`: the link's frame in the
// carrier.
template <class Scalar>
RigidInertia<Scalar> inertia_in(const Pose& frame, const LinkParameters<Scalar>& link) {
  const Mat3<Scalar> rotation = frame.rotation.cast<Scalar>();
  Mat3<Scalar> about_com;
  const auto& I = link.inertia;
  about_com << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
  const Vec3<Scalar> c = rotation * link.com + frame.position.cast<Scalar>();
  const Mat3<Scalar> about_origin =
      rotation * about_com * rotation.transpose() +
      link.mass * (c.squaredNorm() * Mat3<Scalar>::Identity() - c * c.transpose());
  RigidInertia<Scalar> body;
  body.mass = link.mass;
  body.h = link.mass * c;
  body.inertia = {about_origin(0, 0), about_origin(1, 1), about_origin(2, 2),
                  about_origin(0, 1), about_origin(0, 2), about_origin(1, 2)};
  return body;
}

template <class Scalar>
Resistance<Scalar> resistance_of(const JointParameters<Scalar>& joint) {
  Resistance<Scalar> plan;
  plan.friction = joint.friction;
  plan.excess = std::max(Scalar(0), joint.static_friction - joint.friction);
  plan.per_velocity = Scalar(1) / joint.friction_velocity;
  plan.lower = joint.lower;
  plan.upper = joint.upper;
  plan.stiffness = joint.stop_stiffness;
  plan.damping = joint.stop_damping;
  plan.width = joint.stop_width;
  return plan;
}

// First joint of the tree that needs the best accuracy: the first tree, or one with loops, springs or
// contacts that is smaller by two orders of magnitude.
std::size_t smallest_tree(const Model& model, const std::vector<int>& carrier,
                          const std::vector<JointPlan<double>>& joints) {
  std::vector<std::size_t> roots;
  for (const auto& joint : joints)
    roots.push_back(joint.parent == ground ? roots.size() : roots[static_cast<std::size_t>(joint.parent)]);
  std::vector<double> sizes(joints.size(), 0.0);  // m, sum over the links
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (carrier[i] == ground) continue;
    const std::size_t body = static_cast<std::size_t>(carrier[i]), root = roots[body];
    sizes[root] += model.links[i].com.norm();
    if (body != root) sizes[root] += pose_of(model.links[i].joint.dh).position.norm();
  }
  std::size_t smallest = 0;
  const auto consider = [&](int link) {
    if (link == ground || carrier[link] == ground) return;
    const std::size_t root = roots[static_cast<std::size_t>(carrier[link])];
    if (100 * sizes[root] < sizes[smallest]) smallest = root;
  };
  const auto consider_both = [&](const auto& element) {
    consider(element.link_a);
    consider(element.link_b);
  };
  std::for_each(model.loops.begin(), model.loops.end(), consider_both);
  std::for_each(model.springs.begin(), model.springs.end(), consider_both);
  std::for_each(model.bushings.begin(), model.bushings.end(), consider_both);
  for (const Contact& contact : model.contacts) {
    consider(contact.a.link);
    consider(contact.b.link);
  }
  return smallest;
}

// Builds the plan of a model.
struct BuiltPlan : Plan<double> {
  BuiltPlan(const Model& model, const Parameters<double>& parameters);

 private:
  void add_joints(const Model& model);
  void add_rotors(const Model& model);
  void add_springs(const Model& model);
  void add_elastic_couplings(const Model& model);
  void add_bushings(const Model& model);
  void add_contacts(const Model& model);
  void add_ports(const Model& model);
  // The body of a link or the ground, and the link's frame in it.
  int body_of(int link) const { return link == ground ? ground : carrier[link]; }
  Pose frame_of(int link) const { return link == ground ? Pose() : frame_in_carrier[link]; }
};

BuiltPlan::BuiltPlan(const Model& model, const Parameters<double>& parameters) {
  add_joints(model);
  add_rotors(model);
  if (may_resist(model)) resistances.resize(joints.size());
  if (may_have_contacts)
    for (const Contact& contact : model.contacts)
      contact_laws.emplace_back().redysim = contact.law == Contact::Law::redysim;
  update(parameters);
  add_springs(model);
  add_bushings(model);
  add_elastic_couplings(model);
  add_contacts(model);
  add_ports(model);
  build_clusters(model, *this);
  set_poses(*this);
  plain = clusters.empty() && springs.empty() && bushings.empty() && elastic_couplings.empty() &&
          contact_pairs.empty() && ports.empty() && prescribed_count == 0;
}

void BuiltPlan::add_joints(const Model& model) {
  const std::size_t links = model.links.size();
  carrier.reserve(links);
  frame_in_carrier.reserve(links);
  joints.reserve(static_cast<std::size_t>(std::count_if(model.links.begin(), model.links.end(),
                                                        [](const Link& link) { return moves(link.joint); })));
  for (std::size_t i = 0; i < links; ++i) {
    const Link& link = model.links[i];
    const int parent = body_of(link.parent);
    const Pose base = frame_of(link.parent);
    if (!moves(link.joint)) {
      carrier.push_back(parent);
      frame_in_carrier.push_back(base * pose_of(link.joint.dh));
      continue;
    }
    const bool base_moved = link.parent != ground && !moves(model.links[link.parent].joint);
    const Placement placement =
        base_moved ? placement_of(base * pose_of(link.joint.dh)) : placement_of(link.joint.dh);
    carrier.push_back(static_cast<int>(joints.size()));
    frame_in_carrier.push_back(Pose());
    joints.push_back(joint_plan(link.joint, placement, parent, static_cast<int>(i)));
    prescribed_count += joints.back().prescribed ? 1 : 0;
  }
  nv = static_cast<int>(joints.size());
  if (!joints.empty()) {
    const Link& first = model.links[joints[smallest_tree(model, carrier, joints)].link];
    const Pose base = frame_of(first.parent);
    origin = (base * pose_of(first.joint.dh)).position;
  }
  for (const Ball& ball : model.balls) {
    balls.push_back(carrier[ball.chart_link]);
    for (int k = 0; k < 4; ++k) joints[balls.back() + k].of_ball = true;
  }
}

void BuiltPlan::add_rotors(const Model& model) {
  for (const Actuator& actuator : model.actuators) {
    const Link& link = model.links[actuator.link];
    if (!actuator.gyroscopic) continue;
    const Pose base = frame_of(link.parent);
    RotorPlan& rotor = rotors.emplace_back();
    rotor.joint = carrier[actuator.link];
    rotor.parent = joints[rotor.joint].parent;
    rotor.axis = base.rotation * pose_of(link.joint.dh).rotation.col(2);
    rotor.inertia = actuator.rotor_inertia;
    rotor.ratio = actuator.gear_ratio;
  }
}

void BuiltPlan::add_springs(const Model& model) {
  for (const SpringDamper& given : model.springs) {
    SpringPlan<double>& spring = springs.emplace_back();
    spring.body_a = body_of(given.link_a);
    spring.body_b = body_of(given.link_b);
    spring.point_a = (frame_of(given.link_a) * Pose{Mat3<double>::Identity(), given.point_a}).position;
    spring.point_b = (frame_of(given.link_b) * Pose{Mat3<double>::Identity(), given.point_b}).position;
    spring.stiffness = given.stiffness;
    spring.damping = given.damping;
    spring.rest_length = given.rest_length;
  }
}

void BuiltPlan::add_elastic_couplings(const Model& model) {
  for (std::size_t k = 0; k < model.couplings.size(); ++k) {
    const Coupling& given = model.couplings[k];
    if (given.rigid()) continue;
    ElasticCouplingPlan& coupling = elastic_couplings.emplace_back();
    coupling.coupling = static_cast<int>(k);
    for (int link : given.links) coupling.joints.push_back(carrier[link]);
    coupling.ratios = given.ratios;
    coupling.offset = given.offset;
    coupling.stiffness = given.stiffness;
    coupling.damping = given.damping;
    coupling.half_play = given.backlash / 2;
    coupling.width = given.width;
  }
}

void BuiltPlan::add_bushings(const Model& model) {
  for (const Bushing& given : model.bushings) {
    const Pose a = frame_of(given.link_a) * Pose{given.rotation_a, given.point_a};
    const Pose b = frame_of(given.link_b) * Pose{given.rotation_b, given.point_b};
    BushingPlan<double>& bushing = bushings.emplace_back();
    bushing.body_a = body_of(given.link_a);
    bushing.body_b = body_of(given.link_b);
    bushing.point_a = a.position;
    bushing.point_b = b.position;
    bushing.rotation_a = a.rotation;
    bushing.rotation_b = b.rotation;
    bushing.stiffness = given.stiffness;
    bushing.turning_stiffness = given.turning_stiffness;
    bushing.damping = given.damping;
    bushing.turning_damping = given.turning_damping;
  }
}

void BuiltPlan::add_contacts(const Model& model) {
  if constexpr (may_have_contacts) {
    for (std::size_t k = 0; k < model.contacts.size(); ++k) {
      const Contact& contact = model.contacts[k];
      for (const auto& [points, surface] : shape_pairs(contact)) {
        ContactPair<double> pair =
            contact_pair(*points, frame_of(points->link), *surface, frame_of(surface->link));
        pair.contact = static_cast<int>(k);
        // ReDySim's forces act at the points themselves
        if (contact.law == Contact::Law::redysim) pair.half_way = 0;
        pair.sphere_body = body_of(points->link);
        pair.surface_body = body_of(surface->link);
        pair.spheres_on_b = points == &contact.b;
        contact_pairs.push_back(pair);
      }
    }
  }
}

void BuiltPlan::add_ports(const Model& model) {
  for (std::size_t i = 0; i < model.frames.size(); ++i) {
    const Frame& frame = model.frames[i];
    if (frame.port == Frame::Port::none || carrier[frame.link] == ground) continue;
    const Pose in_body = frame_in_carrier[frame.link] * Pose{frame.rotation, frame.position};
    PortPlan<double> port;
    port.frame = static_cast<int>(i);
    port.body = carrier[frame.link];
    port.in_ground_axes = frame.port == Frame::Port::ground_axes;
    port.rotation = in_body.rotation;
    port.position = in_body.position;
    ports.push_back(port);
  }
}

}  // namespace

template <>
Plan<double>::Plan(const Model& model, const Parameters<double>& parameters)
    : Plan(BuiltPlan(model, parameters)) {}

template <class Scalar>
Plan<Scalar>::Plan(const Model& model, const Parameters<Scalar>& parameters) : Plan(Plan<double>(model)) {
  update(parameters);
}

template <class Scalar>
template <class Other>
Plan<Scalar>::Plan(const Plan<Other>& plan)
    : PlanStructure(static_cast<const PlanStructure&>(plan)),
      gravity(plan.gravity.template cast<Scalar>()),
      origin(plan.origin.template cast<Scalar>()),
      joints(cast_each<Scalar>(plan.joints)),
      resistances(plan.resistances.size()),
      springs(cast_each<Scalar>(plan.springs)),
      ports(cast_each<Scalar>(plan.ports)),
      loops(cast_each<Scalar>(plan.loops)) {
  if constexpr (may_have_bushings) bushings = cast_each<Scalar>(plan.bushings);
  if constexpr (may_have_contacts) {
    for (const auto& pair : plan.contact_pairs) contact_pairs.push_back(with_constants_of<Scalar>(pair));
    for (const auto& law : plan.contact_laws) contact_laws.push_back(with_constants_of<Scalar>(law));
  }
}

// The armatures of the parameters contain N^2 J (dynamics/rotor.hpp).
template <class Scalar>
void Plan<Scalar>::update_rotors() {
  for (const RotorPlan& rotor : rotors) {
    JointPlan<Scalar>& joint = joints[rotor.joint];
    const double on_child = rotor.ratio * rotor.inertia, on_parent = rotor.inertia - on_child;
    joint.armature -= on_child;
    joint.axis_free = false;
    joint.inertia.inertia.zz += on_child;
    if (rotor.parent == ground) continue;
    const Vec3<double>& z = rotor.axis;
    const Mat3<Scalar> part = (on_parent * z * z.transpose()).template cast<Scalar>();
    add(joints[rotor.parent].inertia.inertia,
        {part(0, 0), part(1, 1), part(2, 2), part(0, 1), part(0, 2), part(1, 2)});
  }
}

template <class Scalar>
void Plan<Scalar>::update(const Parameters<Scalar>& parameters) {
  gravity = parameters.gravity;
  for (auto& joint : joints) {
    const JointParameters<Scalar>& given = parameters.joints[joint.link];
    joint.stiffness = given.stiffness;
    joint.damping = given.damping;
    joint.rest = given.rest;
    joint.armature = given.armature;
    joint.has_friction = !is_zero(given.friction) || !is_zero(given.static_friction);
    joint.has_stops = has_stops(given) && !is_zero(given.stop_stiffness);
    joint.has_resistance = joint.has_friction || joint.has_stops;
    joint.has_passive_force = !is_zero(given.stiffness) || !is_zero(given.damping) || joint.has_resistance;
    if (!resistances.empty()) resistances[&joint - joints.data()] = resistance_of(given);
    joint.axis_free = joint.subspace == Subspace::rotation && !joint.prescribed && is_zero(given.armature);
    joint.inertia = RigidInertia<Scalar>();
  }
  grounded.setZero();
  for (std::size_t i = 0; i < carrier.size(); ++i) {
    const RigidInertia<Scalar> body = inertia_in(frame_in_carrier[i], parameters.links[i]);
    if (carrier[i] == ground) {
      grounded += body.h;
      continue;
    }
    RigidInertia<Scalar>& sum = joints[carrier[i]].inertia;
    sum.mass += body.mass;
    sum.h += body.h;
    add(sum.inertia, body.inertia);
  }
  update_rotors();
  for (auto& joint : joints) joint.rigid = articulated(joint.inertia);
  for (std::size_t k = 0; k < contact_laws.size(); ++k)
    contact_laws[k] = contact_law(contact_laws[k].redysim, parameters.contacts[k]);
}

template struct Plan<double>;
template struct Plan<Dual>;
template Plan<Dual>::Plan(const Plan<double>&);
template struct Plan<Recorded>;

}  // namespace redysim
