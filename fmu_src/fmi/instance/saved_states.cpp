#include "fmi/instance/saved_states.hpp"

#include <algorithm>
#include <cstdint>

#include "integrate/system/bytes.hpp"
#include "model/read/hash.hpp"

namespace redysim {

Bytes* SavedStates::find(const void* saved) const {
  for (const auto& own : states_)
    if (own.get() == saved) return own.get();
  return nullptr;
}

Bytes& SavedStates::add() {
  states_.push_back(std::make_unique<Bytes>());
  return *states_.back();
}

bool SavedStates::free(const void* saved) {
  const auto own = std::find_if(states_.begin(), states_.end(),
                                [saved](const auto& bytes) { return bytes.get() == saved; });
  if (own == states_.end()) return false;
  states_.erase(own);
  return true;
}

namespace serial {
namespace {

// Kind, version and model of a state.
Bytes kind(const std::string& guid) {
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.put_text("ReDySim-FMU state " REDYSIM_VERSION);
  writer.put_text(guid);
  return bytes;
}

}  // namespace

Bytes header(const std::string& guid, const Bytes& state) {
  Bytes bytes = kind(guid);
  ByteWriter writer(bytes);
  writer.put<std::uint64_t>(state.size());
  writer.put(fnv1a(state.data(), state.size()));
  return bytes;
}

const char* read(const std::string& guid, const unsigned char* bytes, std::size_t size, Bytes& state) {
  const Bytes expected = kind(guid);
  std::uint64_t length = 0, sum = 0;
  if (size < expected.size() + sizeof length + sizeof sum) return "invalid or truncated FMU state";
  if (!std::equal(expected.begin(), expected.end(), bytes))
    return "invalid FMU state, or the state of another model or version";
  // the length in the bytes limits the reading
  ByteReader reader(bytes + expected.size(), size - expected.size());
  reader.get(length);
  reader.get(sum);
  if (length != reader.left()) return "the FMU state is longer or shorter than the one that was saved";
  if (sum != fnv1a(reader.rest(), reader.left())) return "damaged FMU state: wrong check sum";
  state.assign(reader.rest(), reader.rest() + reader.left());
  return nullptr;
}

}  // namespace serial
}  // namespace redysim
