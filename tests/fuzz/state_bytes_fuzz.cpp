// Any bytes as a saved state, behind a header whose size and check sum fit: refused, or taken as a state from
// which a reset brings back the first run bit by bit.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "slave.hpp"

namespace {

void start(fmi2Component slave) {
  fmi2SetupExperiment(slave, fmi2False, 0, 0, fmi2False, 0);
  fmi2EnterInitializationMode(slave);
  fmi2ExitInitializationMode(slave);
}

double run(fmi2Component slave) {
  start(slave);
  fmi2DoStep(slave, 0, 0.01, fmi2True);
  const fmi2ValueReference reference = 3;  // the first joint's q
  double q = 0;
  if (fmi2GetReal(slave, &reference, 1, &q) != fmi2OK) __builtin_trap();
  return q;
}

std::vector<char> serialized(fmi2Component slave) {
  fmi2FMUstate state = nullptr;
  std::size_t size = 0;
  fmi2GetFMUstate(slave, &state);
  fmi2SerializedFMUstateSize(slave, state, &size);
  std::vector<char> bytes(size);
  fmi2SerializeFMUstate(slave, state, bytes.data(), size);
  fmi2FreeFMUstate(slave, &state);
  return bytes;
}

// The header is text, text, size, check sum; as instance_state.cpp writes it.
std::size_t header_size(const std::vector<char>& bytes) {
  std::size_t at = 0;
  for (int text = 0; text < 2; ++text) {
    std::size_t length = 0;
    std::memcpy(&length, &bytes[at], sizeof length);
    at += sizeof length + length;
  }
  return at + 2 * sizeof(std::uint64_t);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const redysim::fuzz::Slave slave;
  static const double expected = run(slave);
  static const std::vector<char> saved = serialized(slave);
  // the saved state, changed by the input from its first byte on, or cut
  const std::size_t header = header_size(saved);
  std::vector<char> bytes = saved;
  for (std::size_t i = 0; i < size && header + i < bytes.size(); ++i)
    bytes[header + i] ^= static_cast<char>(data[i]);
  if (size > 0 && data[0] % 16 == 15) bytes.resize(header + size % (saved.size() - header + 1));
  const std::uint64_t length = bytes.size() - header;
  std::uint64_t sum = 14695981039346656037u;
  for (std::size_t i = header; i < bytes.size(); ++i)
    sum = (sum ^ static_cast<unsigned char>(bytes[i])) * 1099511628211u;
  std::memcpy(&bytes[header - 16], &length, sizeof length);
  std::memcpy(&bytes[header - 8], &sum, sizeof sum);

  fmi2FMUstate state = nullptr;
  if (fmi2DeSerializeFMUstate(slave, bytes.data(), bytes.size(), &state) != fmi2OK) __builtin_trap();
  if (fmi2SetFMUstate(slave, state) == fmi2OK) {
    double time = 0;
    fmi2GetRealStatus(slave, fmi2LastSuccessfulTime, &time);
    fmi2DoStep(slave, time, 1e-6, fmi2True);
  }
  fmi2FreeFMUstate(slave, &state);
  fmi2Reset(slave);
  if (run(slave) != expected) __builtin_trap();
  return 0;
}
