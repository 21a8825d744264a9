#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fmi/instance/bytes.hpp"
#include "fmi/instance/instance.hpp"
#include "fmi/variables/parameters.hpp"

// Saved states: all that the future depends on, as bytes. Serialised, a header of kind, version, model and
// check sum goes before them, so that foreign and damaged bytes are refused.

namespace redysim {
namespace {

// FNV-1a
std::uint64_t check_sum(const unsigned char* bytes, std::size_t size) {
  std::uint64_t sum = 14695981039346656037u;
  for (std::size_t i = 0; i < size; ++i) sum = (sum ^ bytes[i]) * 1099511628211u;
  return sum;
}

bool same(const SolverSettings& a, const SolverSettings& b) {
  return a.method == b.method && a.rtol == b.rtol && a.atol == b.atol && a.max_step == b.max_step;
}

bool is_a_state(State state) {
  for (State known :
       {State::instantiated, State::initialization, State::step, State::failed, State::terminated})
    if (state == known) return true;
  return false;
}

bool is_a_method(SolverMethod method) {
  SolverMethod parsed;
  return parse_method(method_name(method), parsed) && parsed == method;
}

constexpr const char* not_ours = "not an FMU state of this instance";

}  // namespace

// Tuned parameters come into force first, as they do where values are read: the balance goes on from there.
void Instance::save(Bytes& bytes) {
  if (!plan_current_ && impossible_parameter().empty()) renew_plan();
  bytes.clear();
  ByteWriter writer(bytes);
  writer.value(static_cast<std::uint32_t>(state_));
  for (double value : {start_time_, stop_time_, tolerance_, time_, energy_offset_}) writer.value(value);
  writer.value(static_cast<std::uint32_t>(parameters_changed_));
  writer.value(static_cast<std::uint32_t>(settled_));
  writer.value(static_cast<std::uint32_t>(model_.solver.method));
  for (const Variable& variable : table_.all())
    if (const double* value = parameter(model_, variable)) writer.value(*value);
  for (const auto* inputs : {&system_.inputs(), &applied_inputs_}) {
    writer.value(static_cast<std::uint64_t>(inputs->size()));
    writer.values(*inputs);
  }
  writer.values(system_.scales());
  writer.values(motion_);
  writer.block(motion_set_.data(), motion_set_.size());
  if (!integrator_) return;
  integrator_->save(integrator_bytes_);
  writer.block(integrator_bytes_.data(), integrator_bytes_.size());
}

bool Instance::restore(const Bytes& bytes) {
  if (!plan_current_ && impossible_parameter().empty()) renew_plan();  // what a refusal comes back to
  ByteReader reader(bytes.data(), bytes.size());
  std::uint32_t state_code = 0, parameters_changed = 0, settled = 0, method_code = 0;
  double start_time, stop_time, tolerance, time, energy_offset;
  std::vector<double> parameters(start_values_.size()), inputs, applied_inputs, motion(motion_.size());
  reader.value(state_code);
  for (double* value : {&start_time, &stop_time, &tolerance, &time, &energy_offset}) reader.value(*value);
  reader.value(parameters_changed);
  reader.value(settled);
  reader.value(method_code);
  reader.values(parameters);
  for (auto* values : {&inputs, &applied_inputs}) {
    std::uint64_t size = 0;
    if (!reader.value(size) || !system_.is_input_size(size)) return false;
    values->resize(size);
    reader.values(*values);
  }
  std::vector<unsigned char> motion_set(motion_set_.size());
  std::vector<double> scales(system_.scales().size());
  reader.values(scales);
  reader.values(motion);
  if (!reader.block(motion_set.data(), motion_set.size())) return false;
  for (double scale : scales)
    if (!(scale > 0) || !std::isfinite(scale)) return false;
  const auto state = static_cast<State>(state_code);
  auto method = static_cast<SolverMethod>(method_code);
  if (!is_a_state(state) || !is_a_method(method)) return false;

  // the parameters first, for the integrator is made with them; back again if it refuses its bytes
  const auto exchange_parameters = [&] {
    auto saved = parameters.begin();
    for (const Variable& variable : table_.all())
      if (double* value = parameter(model_, variable)) std::swap(*value, *saved++);
    std::swap(model_.solver.method, method);
    std::swap(tolerance_, tolerance);
    system_.scales().swap(scales);
  };
  exchange_parameters();
  system_.update_control(model_);
  plan_.update(model_);  // an integrator that repeats steps needs the plant they were made with
  const SolverSettings settings = effective_settings();
  const bool running = state != State::instantiated && state != State::initialization;
  if (running) {
    std::unique_ptr<Integrator> fresh;
    if (!integrator_ || !same(settings, integrator_settings_)) fresh = make_integrator(system_, settings);
    Integrator& integrator = fresh ? *fresh : *integrator_;
    if (!integrator.restore(reader.rest(), reader.left())) {
      exchange_parameters();
      plan_.update(model_);
      system_.update_control(model_);
      return false;
    }
    if (fresh) integrator_ = std::move(fresh);
    integrator_settings_ = settings;
  } else {
    integrator_.reset();
  }

  plan_current_ = impossible_parameter().empty();
  start_state_current_ = settled_state_current_ = false;
  values_changed();
  state_ = state;
  start_time_ = start_time;
  stop_time_ = stop_time;
  time_ = running ? integrator_->time() : time;  // one clock, whatever the bytes say
  energy_offset_ = energy_offset;
  parameters_changed_ = parameters_changed != 0;
  settled_ = settled != 0;
  system_.swap_inputs(inputs);
  applied_inputs_.swap(applied_inputs);
  motion_.swap(motion);
  motion_set_.swap(motion_set);
  return true;
}

Instance::Bytes* Instance::find_saved(fmi2FMUstate saved) {
  for (const auto& own : saved_)
    if (own.get() == saved) return own.get();
  return nullptr;
}

Instance::Bytes& Instance::add_saved(fmi2FMUstate* saved) {
  saved_.push_back(std::make_unique<Bytes>());
  *saved = saved_.back().get();
  return *saved_.back();
}

fmi2Status Instance::get_fmu_state(fmi2FMUstate* saved) {
  constexpr Function function = Function::get_fmu_state;
  if (!saved) return refuse(function, "the place for the saved state is a null pointer");
  // an earlier one may be given to be written over
  Bytes* bytes = *saved ? find_saved(*saved) : &add_saved(saved);
  if (!bytes) return refuse(function, not_ours);
  save(*bytes);
  return fmi2OK;
}

fmi2Status Instance::set_fmu_state(fmi2FMUstate saved) {
  constexpr Function function = Function::set_fmu_state;
  const Bytes* bytes = find_saved(saved);
  if (!bytes) return refuse(function, not_ours);
  return restore(*bytes) ? fmi2OK : refuse(function, "the saved state does not fit this model");
}

fmi2Status Instance::free_fmu_state(fmi2FMUstate* saved) {
  constexpr Function function = Function::free_fmu_state;
  if (!saved || !*saved) return fmi2OK;
  const auto own =
      std::find_if(saved_.begin(), saved_.end(), [&](const auto& bytes) { return bytes.get() == *saved; });
  if (own == saved_.end()) return refuse(function, not_ours);
  saved_.erase(own);
  *saved = nullptr;
  return fmi2OK;
}

// Kind, version and model; then size and check sum of the bytes that follow.
Instance::Bytes Instance::serial_kind() const {
  Bytes kind;
  ByteWriter writer(kind);
  writer.text("ReDySim-FMU state " REDYSIM_VERSION);
  writer.text(guid_);
  return kind;
}

Instance::Bytes Instance::serial_header(const unsigned char* bytes, std::size_t size) const {
  Bytes header = serial_kind();
  ByteWriter writer(header);
  writer.value(static_cast<std::uint64_t>(size));
  writer.value(check_sum(bytes, size));
  return header;
}

fmi2Status Instance::serialized_size(fmi2FMUstate saved, std::size_t* size) {
  constexpr Function function = Function::serialized_fmu_state_size;
  const Bytes* bytes = find_saved(saved);
  if (!bytes) return refuse(function, not_ours);
  if (!size) return refuse(function, "the place for the size is a null pointer");
  *size = serial_header(bytes->data(), bytes->size()).size() + bytes->size();
  return fmi2OK;
}

fmi2Status Instance::serialize(fmi2FMUstate saved, fmi2Byte* target, std::size_t size) {
  constexpr Function function = Function::serialize_fmu_state;
  const Bytes* bytes = find_saved(saved);
  if (!bytes) return refuse(function, not_ours);
  const Bytes header = serial_header(bytes->data(), bytes->size());
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
  if (!source || !saved) return refuse(function, "an argument is a null pointer");
  const auto* first = reinterpret_cast<const unsigned char*>(source);
  const Bytes kind = serial_kind();
  std::uint64_t length = 0, sum = 0;
  const std::size_t header_size = kind.size() + sizeof length + sizeof sum;
  if (size < header_size) return refuse(function, "invalid or truncated FMU state");
  if (!std::equal(kind.begin(), kind.end(), first))
    return refuse(function, "invalid FMU state, or the state of another model or version");
  // nothing is read beyond what the bytes themselves say that there is
  ByteReader reader(first + kind.size(), size - kind.size());
  reader.value(length);
  reader.value(sum);
  if (length != reader.left())
    return refuse(function, "these bytes are longer or shorter than the state that was saved");
  if (sum != check_sum(reader.rest(), reader.left())) return refuse(function, "these bytes are damaged");
  add_saved(saved).assign(reader.rest(), reader.rest() + reader.left());
  return fmi2OK;
}

}  // namespace redysim
