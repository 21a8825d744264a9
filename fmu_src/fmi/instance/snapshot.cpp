#include "fmi/instance/snapshot.hpp"

#include <cmath>
#include <cstdint>

#include "fmi/variables/parameters.hpp"
#include "integrate/system/bytes.hpp"
#include "model/solver_methods.hpp"

namespace redysim {
namespace {

bool is_a_state(State state) {
  for (State known : {State::instantiated, State::initialization, State::step, State::failed,
                      State::terminated, State::event, State::continuous})
    if (state == known) return true;
  return false;
}

bool is_a_method(SolverMethod method) {
  SolverMethod parsed;
  return parse_method(method_name(method), parsed) && parsed == method;
}

}  // namespace

// Visits the scalars at the beginning of the bytes, in their order.
template <class Self, class Visit>
void Snapshot::each_number(Self& self, const Visit& visit) {
  visit(self.life.state);
  visit(self.life.start_time);
  visit(self.life.stop_time);
  visit(self.life.tolerance);
  visit(self.time);
  visit(self.energy_offset);
  visit(self.pending.in_force);
  visit(self.pending.changed);
  visit(self.pending.inertia_tuned);
  visit(self.pending.given);
  visit(self.follows_motion);
  visit(self.method);
}

void Snapshot::write(Bytes& bytes) const {
  ByteWriter writer(bytes);
  each_number(*this, [&writer](const auto& number) {
    if constexpr (std::is_same_v<decltype(number), const double&>)
      writer.put(number);
    else
      writer.put(static_cast<std::uint32_t>(number));
  });
  writer.put(parameters.data(), parameters.size());
  for (const auto* numbers : {&inputs, &applied_inputs}) {
    writer.put<std::uint64_t>(numbers->size());
    writer.put(numbers->data(), numbers->size());
  }
  writer.put(scales.data(), scales.size());
  writer.put(motion.values.data(), motion.values.size());
  writer.put(motion.was_set.data(), motion.was_set.size());
  writer.put<std::uint64_t>(step.size());
  writer.put(step.data(), step.size());
}

bool Snapshot::read(const Bytes& bytes, const Sizes& sizes, const System& system) {
  ByteReader reader(bytes.data(), bytes.size());
  each_number(*this, [&reader](auto& number) {
    using Number = std::remove_reference_t<decltype(number)>;
    if constexpr (std::is_same_v<Number, double>) {
      reader.get(number);
    } else {
      std::uint32_t code = 0;
      reader.get(code);
      number = static_cast<Number>(code);
    }
  });
  const auto get = [&reader](auto& numbers, std::size_t size) {
    numbers.resize(size);
    reader.get(numbers.data(), size);
  };
  get(parameters, sizes.parameters);
  for (auto* numbers : {&inputs, &applied_inputs}) {
    std::uint64_t size = 0;
    reader.get(size);
    if (!reader.good() || !system.is_input_size(size)) return false;
    get(*numbers, size);
  }
  get(scales, sizes.scales);
  get(motion.values, sizes.motions);
  get(motion.was_set, sizes.motions);
  std::uint64_t step_size = 0;
  reader.get(step_size);
  if (!reader.good() || step_size > reader.left() / sizeof(double)) return false;
  get(step, step_size);
  integrator = reader.rest();
  integrator_size = reader.left();
  return reader.good() && is_valid();
}

bool Snapshot::is_valid() const {
  for (double scale : scales)
    if (!(scale > 0) || !std::isfinite(scale)) return false;
  return is_a_state(life.state) && is_a_method(method) && pending.given <= ParameterSet::Given::applied;
}

}  // namespace redysim
