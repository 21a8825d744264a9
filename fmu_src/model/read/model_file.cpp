#include "model/read/model_file.hpp"

#include "model/read/actuator_reader.hpp"
#include "model/read/compound_joint.hpp"
#include "model/read/contact_reader.hpp"
#include "model/read/controller_reader.hpp"
#include "model/read/coupling_reader.hpp"
#include "model/read/frame_reader.hpp"
#include "model/read/link_reader.hpp"
#include "model/read/loop_reader.hpp"
#include "model/read/model_checks.hpp"
#include "model/read/open_file.hpp"
#include "model/read/settings_reader.hpp"
#include "model/read/trajectory_reader.hpp"
#include "model/read/tree.hpp"

namespace redysim {
namespace {

std::string read_bytes(const std::string& path) {
  std::string bytes;
  if (const char* why = read_file(path, bytes))
    throw ModelError(ModelError::Reason::unreadable, {{path, 0, 0, std::string("the model file ") + why}});
  return bytes;
}

std::string read_name(Section& top) {
  top.require("name");
  std::string name = top.identifier("name");
  if (name.size() > 200) top.error("name", "name is part of file names: at most 200 characters are possible");
  return name;
}

bool read_degrees(Section& top) {
  return top.choice<bool>("angle_unit", {{"rad", false}, {"deg", true}}, false);
}

// Replaces torque inputs by prescribed motions. Free joints stay free, and joints with a quaternion cannot be
// prescribed.
void invert(std::vector<LinkDraft>& drafts, Section& top) {
  bool driven = false;
  for (LinkDraft& draft : drafts) {
    Joint& joint = draft.link.joint;
    const bool prescribable = draft.compound ? !has_ball(*draft.compound) : moves(joint);
    if (!prescribable || joint.drive != Drive::torque) continue;
    joint.drive = Drive::motion;
    driven = true;
  }
  if (!driven) top.warn("inverse", "inverse has no effect: no joint has drive 'torque'");
}

// Also adds the rotor behind a rigid gear to the armature of the joint, in the model and in the drafts.
void read_actuators(Section& top, bool inverse, Model& model, std::vector<LinkDraft>& drafts,
                    Findings& findings) {
  model.actuators = read_actuators(top, model, inverse, findings);
  for (const Actuator& actuator : model.actuators) {
    if (actuator.is_elastic()) continue;
    Joint& joint = model.links[actuator.link].joint;
    joint.armature += actuator.gear_ratio * actuator.gear_ratio * actuator.rotor_inertia;
    drafts[actuator.link].link.joint.armature = joint.armature;
  }
}

LinkTable link_table(const std::vector<LinkDraft>& drafts, bool sound) {
  LinkTable links;
  for (const LinkDraft& draft : drafts) {
    links.index.add(draft.link.name, static_cast<int>(links.names.size()));
    links.names.push_back(draft.link.name);
  }
  if (sound) links.carriers = rigid_carriers(drafts);
  return links;
}

// Reads trajectories and the controller that uses them.
void read_guidance(Section& top, Model& model, bool degrees, bool inverse, const std::string& folder,
                   std::vector<AttachedFile>& files, Findings& findings) {
  model.trajectories = read_trajectories(top, model, degrees, folder, files, findings);
  model.controller = read_controller(top, model, degrees, inverse, findings);
  if (findings.error_count() != 0) return;
  check_trajectories(top, model, findings);
  check_controlled_actuators(top, model, findings);
}

Model read_model(Section& top, const std::string& folder, std::vector<AttachedFile>& files,
                 Findings& findings) {
  Model model;
  Names names;
  model.name = read_name(top);
  const bool inverse = top.flag("inverse", false);
  if (inverse) model.name += "_inverse";
  model.description = top.text("description");
  model.gravity = top.vector("gravity", model.gravity);
  const bool degrees = read_degrees(top);
  model.starts_in_equilibrium = top.choice<bool>("start", {{"given", false}, {"equilibrium", true}}, false);

  std::vector<LinkDraft> drafts = read_links(top, degrees, names, findings);
  if (inverse) invert(drafts, top);
  arrange_tree(drafts);
  model.balls = expand_compound_joints(drafts);
  const bool sound = findings.error_count() == 0;
  model.links.reserve(drafts.size());
  for (const LinkDraft& draft : drafts) model.links.push_back(draft.link);
  read_actuators(top, inverse, model, drafts, findings);
  if (sound) check_movable(drafts, top);
  const LinkTable links = link_table(drafts, sound);

  model.loops = read_loops(top, links, names, findings);
  model.couplings = read_couplings(top, model, names, findings);
  model.springs = read_springs(top, links, names, findings);
  model.bushings = read_bushings(top, links, degrees, names, findings);
  model.contacts = read_contacts(top, links, degrees, names, folder, files, findings);
  model.frames = read_frames(top, model, links, degrees, names, findings);
  model.solver = read_solver(top, findings);
  read_guidance(top, model, degrees, inverse, folder, files, findings);
  model.fmu = read_fmu(top, model, findings);
  model.report = read_report(top, findings);
  if (inverse) drop_drives(model);
  top.tables("shape");  // for drawings only, see read_shapes()
  top.refuse_unknown();
  return model;
}

}  // namespace

ModelFile read_model_text(const std::string& text, const std::string& name) {
  const Value document = parse_toml(text, name);
  Findings findings(name);
  Section top(document, "", findings);
  std::vector<AttachedFile> files;
  Model model = read_model(top, name.substr(0, name.rfind('/') + 1), files, findings);
  if (findings.error_count() > 0) throw ModelError(ModelError::Reason::invalid, findings.errors());
  ModelFile file{std::move(model), findings.warnings(), text, {}};
  for (const AttachedFile& attached : files) {
    file.source += '\n' + attached.name + '\n' + attached.bytes;
    file.attached.push_back(attached.name);
  }
  return file;
}

ModelFile read_model_file(const std::string& path) { return read_model_text(read_bytes(path), path); }

}  // namespace redysim
