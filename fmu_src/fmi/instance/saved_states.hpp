#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace redysim {

using Bytes = std::vector<unsigned char>;

// Saved states that the master holds.
class SavedStates {
 public:
  Bytes* find(const void* saved) const;  // null: not saved here
  Bytes& add();
  bool free(const void* saved);

 private:
  std::vector<std::unique_ptr<Bytes>> states_;
};

// Serialised states. A header with kind, version, model, length and checksum comes first, so foreign and
// damaged bytes are refused.
namespace serial {
Bytes header(const std::string& guid, const Bytes& state);
// Reads the state in `bytes`. Returns why they are invalid, null on success.
const char* read(const std::string& guid, const unsigned char* bytes, std::size_t size, Bytes& state);
}  // namespace serial

}  // namespace redysim
