#include "integrate/methods/state_bytes.hpp"

namespace redysim {

StateHeader state_header(const System& system, const SolverSettings& settings, SolverMethod method) {
  constexpr std::uint32_t magic = 0x49534452;  // "RDSI"
  constexpr std::uint32_t version = 11;        // also of the data after the header
  return {magic,           version,       static_cast<std::uint32_t>(method),
          system.nq(),     system.nv(),   system.size(),
          settings.rtol,   settings.atol, settings.max_step,
          settings.max_rhs};
}

void put(ByteWriter& writer, const StateHeader& header) {
  writer.put(header.magic);
  writer.put(header.version);
  writer.put(header.method);
  writer.put(header.nq);
  writer.put(header.nv);
  writer.put(header.size);
  writer.put(header.rtol);
  writer.put(header.atol);
  writer.put(header.max_step);
  writer.put(header.max_rhs);
}

bool matches(ByteReader& reader, const StateHeader& expected) {
  std::vector<unsigned char> bytes;
  ByteWriter writer(bytes);
  put(writer, expected);
  std::vector<unsigned char> read(bytes.size());
  reader.get(read.data(), read.size());
  return reader.good() && read == bytes;
}

namespace {

constexpr std::int64_t Statistics::*counts[] = {&Statistics::steps, &Statistics::rejected,
                                                &Statistics::evaluations, &Statistics::jacobians,
                                                &Statistics::loosened};
constexpr double Statistics::*sizes[] = {&Statistics::step_size, &Statistics::error_estimate,
                                         &Statistics::other_work};

}  // namespace

void put(ByteWriter& writer, const Statistics& statistics) {
  for (const auto count : counts) writer.put(statistics.*count);
  for (const auto size : sizes) writer.put(statistics.*size);
}

void get(ByteReader& reader, Statistics& statistics) {
  for (const auto count : counts) reader.get(statistics.*count);
  for (const auto size : sizes) reader.get(statistics.*size);
}

}  // namespace redysim
