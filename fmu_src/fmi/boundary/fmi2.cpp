// The C boundary: every co-simulation function of FMI 2.0, each one line around the instance.

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <utility>

#include "dynamics/straight_line/straight_line.hpp"
#include "fmi/boundary/call_table.hpp"
#include "fmi/boundary/log.hpp"
#include "fmi/boundary/resource_location.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/platform/float_mode.hpp"
#include "fmi2Functions.h"
#include "model/features.hpp"
#include "model/read/fingerprint.hpp"
#include "model/read/model_file.hpp"
#include "model/read/open_file.hpp"

using redysim::FloatMode;
using redysim::Function;
using redysim::Instance;
using redysim::Log;

namespace {

// What an fmi2Component points to.
struct Component {
  Component(const Log& log, redysim::ModelFile&& file, std::string guid, fmi2CallbackFreeMemory release_)
      : instance(log, std::move(file.model), std::move(guid)), release(release_) {}
  Instance instance;
  fmi2CallbackFreeMemory release;  // of this block
};
static_assert(alignof(Component) <= alignof(std::max_align_t),
              "the environment's memory is aligned like malloc's");

void log_exception(const Log& log, const char* function) noexcept {
  try {
    try {
      throw;
    } catch (const redysim::ModelError& error) {
      for (const redysim::Diagnostic& diagnostic : error.diagnostics())
        log.error(std::string(function) + ": " + diagnostic.text());
    } catch (const std::bad_alloc&) {
      log.error(std::string(function) + ": out of memory");
    } catch (const std::exception& error) {
      log.error(std::string(function) + ": " + error.what());
    }
  } catch (...) {
  }
}

// Checks the call table, makes the call and turns any exception into a status and a log line.
template <class Call>
fmi2Status guarded(fmi2Component component, Function function, Call&& call) noexcept {
  if (!component) return fmi2Error;
  const FloatMode ours;
  Instance& instance = static_cast<Component*>(component)->instance;
  try {
    if (!redysim::is_allowed(function, instance.state()))
      return instance.refuse(function,
                             std::string("not allowed while the instance is ") + name(instance.state()));
    return call(instance);
  } catch (...) {
    log_exception(instance.log(), name(function));
    return fmi2Error;
  }
}

// The model file of the unpacked FMU; empty, with the reason logged, if there is none.
std::string find_model_file(const Log& log, const char* location) {
  std::vector<std::string> folders = redysim::resource_folders(location);
  const std::string own = redysim::own_resource_folder();
  if (!own.empty()) folders.push_back(own);
  std::string tried;
  for (const std::string& folder : folders) {
    const std::string path = folder + "/model.toml";
    const char* why = nullptr;
    if (std::FILE* file = redysim::open_file(path, why)) {
      std::fclose(file);
      log.event("reading '" + path + "'");
      return path;
    }
    tried += (tried.empty() ? "'" : ", '") + path + "' " + why;
  }
  log.error("fmi2Instantiate: cannot read a model file: " + tried);
  return {};
}

// GUIDs are hexadecimal numbers; tools write them in either case.
bool is_same_guid(const std::string& own, const std::string& given) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(own.begin(), own.end(), given.begin(), given.end(),
                    [lower](char a, char b) { return lower(a) == lower(b); });
}

// The standard requires at least one character that is not white space.
bool is_a_name(fmi2String text) { return text && text[std::strspn(text, " \t\n\v\f\r")] != '\0'; }

// The first part of a specialised library that does not fit the scene, as a sentence; empty: all fit.
std::string objection_of_library(const redysim::Model& model, const std::string& guid,
                                 const std::string& path) {
  if constexpr (redysim::features::straight_line) {
    if (guid != redysim::straight_line_scene)
      return "this library was specialised for another scene than '" + path + "'";
  }
  const std::string missing = redysim::missing_feature(model);
  if (missing.empty()) return {};
  return "this library was specialised for another scene, without " + missing + ", which '" + path + "' uses";
}

// In the memory of the environment, if it offers any.
Component* make_component(const Log& log, redysim::ModelFile&& file, std::string&& guid,
                          const fmi2CallbackFunctions* functions) {
  const bool has_memory = functions && functions->allocateMemory && functions->freeMemory;
  const fmi2CallbackFreeMemory release = has_memory ? functions->freeMemory : std::free;
  void* memory =
      has_memory ? functions->allocateMemory(1, sizeof(Component)) : std::calloc(1, sizeof(Component));
  if (!memory) throw std::bad_alloc();
  try {
    return new (memory) Component(log, std::move(file), std::move(guid), release);
  } catch (...) {
    release(memory);
    throw;
  }
}

Component* instantiate(const Log& log, fmi2String instance_name, fmi2Type type, fmi2String guid,
                       fmi2String location, const fmi2CallbackFunctions* functions) {
  const auto refuse = [&log](const std::string& why) {
    log.error("fmi2Instantiate: " + why);
    return nullptr;
  };
  if (!is_a_name(instance_name)) return refuse("the instance has no name");
  if (type != fmi2CoSimulation) return refuse("this FMU is for co-simulation only");
  const std::string path = find_model_file(log, location);
  if (path.empty()) return nullptr;
  redysim::ModelFile file = redysim::read_model_file(path);
  for (const redysim::Diagnostic& warning : file.warnings) log.warning(warning.text());
  std::string own_guid = redysim::fingerprint(file.source);
  if (!guid || !is_same_guid(own_guid, guid))
    return refuse("the GUID " + std::string(guid ? guid : "(null)") + " differs from that of '" + path +
                  "', " + own_guid + ": modelDescription.xml belongs to another model file");
  const std::string objection = objection_of_library(file.model, own_guid, path);
  if (!objection.empty()) return refuse(objection);
  return make_component(log, std::move(file), std::move(own_guid), functions);
}

fmi2Status only_for_pending_steps(Instance& instance, Function function) {
  return instance.refuse(
      function, "this status exists only while a step is pending; steps of this FMU are synchronous");
}

}  // namespace

// Replaces libstdc++'s handler, which writes to stderr and brings the symbol demangler along.
namespace __gnu_cxx {
void __verbose_terminate_handler() { std::abort(); }
}  // namespace __gnu_cxx

const char* fmi2GetTypesPlatform() { return fmi2TypesPlatform; }

const char* fmi2GetVersion() { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instance_name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean logging_on) {
  const FloatMode ours;
  try {
    const Log log(functions, instance_name, logging_on);
    try {
      return instantiate(log, instance_name, type, guid, location, functions);
    } catch (...) {
      log_exception(log, "fmi2Instantiate");
    }
  } catch (...) {
  }
  return nullptr;
}

void fmi2FreeInstance(fmi2Component component) {
  if (!component) return;
  Component* own = static_cast<Component*>(component);
  const fmi2CallbackFreeMemory release = own->release;
  own->~Component();
  release(own);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]) {
  return guarded(c, Function::set_debug_logging,
                 [&](Instance& i) { return i.set_debug_logging(on, count, categories); });
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  return guarded(c, Function::setup_experiment, [&](Instance& i) {
    return i.setup_experiment(has_tolerance, tolerance, start, has_stop, stop);
  });
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  return guarded(c, Function::enter_initialization_mode,
                 [](Instance& i) { return i.enter_initialization_mode(); });
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  return guarded(c, Function::exit_initialization_mode,
                 [](Instance& i) { return i.exit_initialization_mode(); });
}

fmi2Status fmi2Terminate(fmi2Component c) {
  return guarded(c, Function::terminate, [](Instance& i) { return i.terminate(); });
}

fmi2Status fmi2Reset(fmi2Component c) {
  return guarded(c, Function::reset, [](Instance& i) { return i.reset(); });
}

// --- variables ---

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
  return guarded(c, Function::get_real, [&](Instance& i) { return i.get_real(vr, nvr, value); });
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
  return guarded(c, Function::get_integer, [&](Instance& i) { return i.get_integer(vr, nvr, value); });
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference[], size_t nvr, fmi2Boolean[]) {
  return guarded(c, Function::get_boolean,
                 [&](Instance& i) { return i.no_booleans(Function::get_boolean, nvr); });
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
  return guarded(c, Function::get_string, [&](Instance& i) { return i.get_string(vr, nvr, value); });
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
  return guarded(c, Function::set_real, [&](Instance& i) { return i.set_real(vr, nvr, value); });
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer[]) {
  return guarded(c, Function::set_integer, [&](Instance& i) { return i.set_integer(vr, nvr); });
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference[], size_t nvr, const fmi2Boolean[]) {
  return guarded(c, Function::set_boolean,
                 [&](Instance& i) { return i.no_booleans(Function::set_boolean, nvr); });
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         const fmi2String value[]) {
  return guarded(c, Function::set_string, [&](Instance& i) { return i.set_string(vr, nvr, value); });
}

// --- saved states ---

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* saved) {
  return guarded(c, Function::get_fmu_state, [&](Instance& i) { return i.get_fmu_state(saved); });
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate saved) {
  return guarded(c, Function::set_fmu_state, [&](Instance& i) { return i.set_fmu_state(saved); });
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* saved) {
  return guarded(c, Function::free_fmu_state, [&](Instance& i) { return i.free_fmu_state(saved); });
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate saved, size_t* size) {
  return guarded(c, Function::serialized_fmu_state_size,
                 [&](Instance& i) { return i.serialized_size(saved, size); });
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate saved, fmi2Byte bytes[], size_t size) {
  return guarded(c, Function::serialize_fmu_state,
                 [&](Instance& i) { return i.serialize(saved, bytes, size); });
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate* saved) {
  return guarded(c, Function::deserialize_fmu_state,
                 [&](Instance& i) { return i.deserialize(bytes, size, saved); });
}

// --- derivatives ---

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t nu,
                                        const fmi2ValueReference knowns[], size_t nk,
                                        const fmi2Real directions[], fmi2Real derivatives[]) {
  return guarded(c, Function::get_directional_derivative, [&](Instance& i) {
    return i.get_directional_derivative(unknowns, nu, knowns, nk, directions, derivatives);
  });
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  return guarded(c, Function::set_real_input_derivatives,
                 [&](Instance& i) { return i.set_real_input_derivatives(vr, nvr, order, value); });
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
  return guarded(c, Function::get_real_output_derivatives,
                 [&](Instance& i) { return i.get_real_output_derivatives(vr, nvr, order, value); });
}

// --- steps ---

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real current, fmi2Real size, fmi2Boolean) {
  return guarded(c, Function::do_step, [&](Instance& i) { return i.do_step(current, size); });
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return guarded(c, Function::cancel_step, [](Instance&) { return fmi2Error; });
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status* value) {
  constexpr Function function = Function::get_status;
  return guarded(c, function, [&](Instance& i) {
    if (kind != fmi2DoStepStatus || !value)
      return i.refuse(function, "the only status of type fmi2Status is fmi2DoStepStatus");
    *value = i.last_step_status();
    return fmi2OK;
  });
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value) {
  constexpr Function function = Function::get_real_status;
  return guarded(c, function, [&](Instance& i) {
    if (kind != fmi2LastSuccessfulTime || !value)
      return i.refuse(function, "the only status of type Real is fmi2LastSuccessfulTime");
    *value = i.last_successful_time();
    return fmi2OK;
  });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind, fmi2Integer*) {
  constexpr Function function = Function::get_integer_status;
  return guarded(c, function,
                 [](Instance& i) { return i.refuse(function, "there is no status of type Integer"); });
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean* value) {
  constexpr Function function = Function::get_boolean_status;
  return guarded(c, function, [&](Instance& i) {
    if (kind != fmi2Terminated || !value)
      return i.refuse(function, "the only status of type Boolean is fmi2Terminated");
    *value = fmi2False;  // the FMU never ends a simulation by itself
    return fmi2OK;
  });
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind, fmi2String*) {
  constexpr Function function = Function::get_string_status;
  return guarded(c, function, [](Instance& i) { return only_for_pending_steps(i, function); });
}
