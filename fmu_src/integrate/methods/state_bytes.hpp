#pragma once

#include <cstdint>

#include "integrate/methods/integrator.hpp"
#include "integrate/system/bytes.hpp"

// Common parts of the saved states of all integrators.

namespace redysim {

// Data that must agree when a state is restored.
struct StateHeader {
  std::uint32_t magic, version, method;
  std::int32_t nq, nv, size;
  double rtol, atol, max_step, max_rhs;
};
StateHeader state_header(const System& system, const SolverSettings& settings, SolverMethod method);
void put(ByteWriter& writer, const StateHeader& header);
bool matches(ByteReader& reader, const StateHeader& expected);  // reads the header and compares it

void put(ByteWriter& writer, const Statistics& statistics);
void get(ByteReader& reader, Statistics& statistics);

}  // namespace redysim
