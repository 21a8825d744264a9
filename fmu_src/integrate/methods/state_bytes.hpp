#pragma once

#include "integrate/methods/integrator.hpp"
#include "integrate/system/bytes.hpp"

// Common parts of the saved states of all integrators.

namespace redysim {

// Writes what must agree when a state is restored: version, method, sizes and settings.
void put_header(ByteWriter& writer, const System& system, const SolverSettings& settings,
                SolverMethod method);
// Reads a header; whether it agrees.
bool has_header(ByteReader& reader, const System& system, const SolverSettings& settings,
                SolverMethod method);

void put(ByteWriter& writer, const Statistics& statistics);
void get(ByteReader& reader, Statistics& statistics);

}  // namespace redysim
