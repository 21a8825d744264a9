#include <algorithm>

#include "fmi/boundary/arrays.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/instance/snapshot.hpp"

// Saved states.

namespace redysim {
namespace {

constexpr const char* foreign = "not an FMU state of this instance";

}  // namespace

// First applies tuned parameters and a given state, as far as possible, as when values are read.
void Instance::save(Bytes& bytes) {
  parameters_.bring_into_force();
  System& system = simulation_.system;
  Snapshot now;
  now.life = life_;
  now.time = simulation_.time;
  now.energy_offset = parameters_.energy_offset;
  now.pending = parameters_.pending();
  now.follows_motion = state_.follows_motion();
  now.method = simulation_.parameters.solver.method;
  now.parameters = parameters_.values();
  now.inputs = system.inputs();
  now.applied_inputs = applied_inputs_;
  now.scales = system.scales();
  now.motion = motion_.saved();
  if (values_.step_jacobian()) now.step = values_.step_jacobian()->saved();
  bytes.clear();
  now.write(bytes);
  if (simulation_.integrator) simulation_.integrator->save(bytes);
}

// Parse, validate, commit. A new integrator chooses its tables by the plan, and one that repeats steps needs
// the plant. The integrator therefore validates its bytes with the saved parameters; if it refuses them, the
// previous parameters are restored.
bool Instance::restore(const Bytes& bytes) {
  parameters_.bring_into_force();  // after a refusal, this state remains
  System& system = simulation_.system;
  Snapshot saved;
  if (!saved.read(bytes, {parameters_.size(), system.scales().size(), motion_.size()}, system)) return false;
  StepJacobian* const jacobian = values_.step_jacobian();
  if (jacobian ? !jacobian->fits(saved.step) : !saved.step.empty()) return false;
  if (!restore_integrator(saved)) return false;

  life_ = saved.life;
  // the time of the integrator is authoritative
  simulation_.time = saved.is_running() ? simulation_.integrator->time() : saved.time;
  parameters_.energy_offset = saved.energy_offset;
  parameters_.restored(saved.pending);
  state_.restored(saved.follows_motion);
  values_.changed();
  nominals_are_new_ = true;
  system.swap_inputs(saved.inputs);
  applied_inputs_.swap(saved.applied_inputs);
  motion_.restore(std::move(saved.motion));
  if (jacobian) jacobian->restore(saved.step);
  return true;
}

// Takes over parameters and integrator. False: nothing has changed.
bool Instance::restore_integrator(Snapshot& saved) {
  System& system = simulation_.system;
  const auto exchange = [&] {
    parameters_.exchange(saved.parameters, saved.method);
    system.scales().swap(saved.scales);
    // an integrator that repeats steps needs the saved plant
    simulation_.plan.update(simulation_.parameters);
    system.update_drives(simulation_.parameters);
  };
  exchange();
  if (!saved.is_running()) {
    simulation_.integrator.reset();
    return true;
  }
  const SolverSettings settings = saved.life.effective(simulation_.parameters.solver);
  std::unique_ptr<Integrator> fresh;
  if (!simulation_.integrator || !settings.same_steps(simulation_.integrator_settings))
    fresh = simulation_.make_integrator(settings);
  Integrator& integrator = fresh ? *fresh : *simulation_.integrator;
  if (!integrator.restore(saved.integrator, saved.integrator_size)) {
    exchange();
    return false;
  }
  if (fresh) simulation_.integrator = std::move(fresh);
  simulation_.integrator_settings = settings;
  return true;
}

fmi2Status Instance::get_fmu_state(fmi2FMUstate* saved) {
  constexpr Function function = Function::get_fmu_state;
  if (!saved) return refuse(function, null_pointer);
  // *saved may refer to an existing state, which is overwritten
  Bytes* bytes = *saved ? saved_.find(*saved) : &saved_.add();
  if (!bytes) return refuse(function, foreign);
  *saved = bytes;
  save(*bytes);
  return fmi2OK;
}

fmi2Status Instance::set_fmu_state(fmi2FMUstate saved) {
  constexpr Function function = Function::set_fmu_state;
  const Bytes* bytes = saved_.find(saved);
  if (!bytes) return refuse(function, foreign);
  return restore(*bytes) ? fmi2OK : refuse(function, "the FMU state does not fit this model");
}

fmi2Status Instance::free_fmu_state(fmi2FMUstate* saved) {
  if (!saved || !*saved) return fmi2OK;
  if (!saved_.free(*saved)) return refuse(Function::free_fmu_state, foreign);
  *saved = nullptr;
  return fmi2OK;
}

fmi2Status Instance::serialized_size(fmi2FMUstate saved, std::size_t* size) {
  constexpr Function function = Function::serialized_fmu_state_size;
  const Bytes* bytes = saved_.find(saved);
  if (!bytes) return refuse(function, foreign);
  if (!size) return refuse(function, null_pointer);
  *size = serial::header(guid_, *bytes).size() + bytes->size();
  return fmi2OK;
}

fmi2Status Instance::serialize(fmi2FMUstate saved, fmi2Byte* target, std::size_t size) {
  constexpr Function function = Function::serialize_fmu_state;
  const Bytes* bytes = saved_.find(saved);
  if (!bytes) return refuse(function, foreign);
  const Bytes header = serial::header(guid_, *bytes);
  const std::size_t needed = header.size() + bytes->size();
  if (!target || size < needed)
    return refuse(function,
                  std::to_string(needed) + " bytes are needed, got " + std::to_string(target ? size : 0));
  std::copy(header.begin(), header.end(), target);
  std::copy(bytes->begin(), bytes->end(), target + header.size());
  return fmi2OK;
}

fmi2Status Instance::deserialize(const fmi2Byte* source, std::size_t size, fmi2FMUstate* saved) {
  constexpr Function function = Function::deserialize_fmu_state;
  if (!source || !saved) return refuse(function, null_pointer);
  Bytes bytes;
  if (const char* why = serial::read(guid_, reinterpret_cast<const unsigned char*>(source), size, bytes))
    return refuse(function, why);
  Bytes& own = saved_.add();
  own.swap(bytes);
  *saved = &own;
  return fmi2OK;
}

}  // namespace redysim
