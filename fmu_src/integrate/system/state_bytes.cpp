#include "integrate/system/state_bytes.hpp"

namespace redysim {

StateHeader state_header(const System& system, const SolverSettings& settings, SolverMethod method) {
  constexpr std::uint32_t magic = 0x49534452;  // "RDSI"
  constexpr std::uint32_t version = 5;         // of the bytes below the header too
  return {magic,         version,       static_cast<std::uint32_t>(method),
          system.nq(),   system.nv(),   system.size(),
          settings.rtol, settings.atol, settings.max_step};
}

void put(StateWriter& writer, const StateHeader& header) {
  writer.put(header.magic);
  writer.put(header.version);
  writer.put(header.method);
  writer.put(header.nq);
  writer.put(header.nv);
  writer.put(header.size);
  writer.put(header.rtol);
  writer.put(header.atol);
  writer.put(header.max_step);
}

bool matches(StateReader& reader, const StateHeader& expected) {
  StateHeader read{};
  reader.get(read.magic);
  reader.get(read.version);
  reader.get(read.method);
  reader.get(read.nq);
  reader.get(read.nv);
  reader.get(read.size);
  reader.get(read.rtol);
  reader.get(read.atol);
  reader.get(read.max_step);
  return reader.good() && read.magic == expected.magic && read.version == expected.version &&
         read.method == expected.method && read.nq == expected.nq && read.nv == expected.nv &&
         read.size == expected.size && read.rtol == expected.rtol && read.atol == expected.atol &&
         read.max_step == expected.max_step;
}

void put(StateWriter& writer, const Statistics& statistics) {
  writer.put<std::int64_t>(statistics.steps);
  writer.put<std::int64_t>(statistics.rejected);
  writer.put<std::int64_t>(statistics.evaluations);
  writer.put<std::int64_t>(statistics.jacobians);
  writer.put(statistics.step_size);
  writer.put(statistics.error_estimate);
}

void get(StateReader& reader, Statistics& statistics) {
  std::int64_t steps = 0, rejected = 0, evaluations = 0, jacobians = 0;
  reader.get(steps);
  reader.get(rejected);
  reader.get(evaluations);
  reader.get(jacobians);
  statistics.steps = static_cast<long>(steps);
  statistics.rejected = static_cast<long>(rejected);
  statistics.evaluations = static_cast<long>(evaluations);
  statistics.jacobians = static_cast<long>(jacobians);
  reader.get(statistics.step_size);
  reader.get(statistics.error_estimate);
}

}  // namespace redysim
