#include "integrate/methods/state_bytes.hpp"

namespace redysim {

void put_header(ByteWriter& writer, const System& system, const SolverSettings& settings,
                SolverMethod method) {
  constexpr std::uint32_t magic = 0x49534452;  // "RDSI"
  constexpr std::uint32_t version = 11;        // also of the data after the header
  writer.put(magic);
  writer.put(version);
  writer.put(static_cast<std::uint32_t>(method));
  for (const int size : {system.nq(), system.nv(), system.size()}) writer.put(size);
  for (const double setting : {settings.rtol, settings.atol, settings.max_step, settings.max_rhs})
    writer.put(setting);
}

bool has_header(ByteReader& reader, const System& system, const SolverSettings& settings,
                SolverMethod method) {
  std::vector<unsigned char> expected;
  ByteWriter writer(expected);
  put_header(writer, system, settings, method);
  std::vector<unsigned char> read(expected.size());
  reader.get(read.data(), read.size());
  return reader.good() && read == expected;
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
