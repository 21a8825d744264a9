#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace redysim {

using Bytes = std::vector<unsigned char>;

// The saved states that the master holds.
class SavedStates {
 public:
  Bytes* find(const void* saved) const;  // null: not one of these
  Bytes& add();
  bool free(const void* saved);

 private:
  std::vector<std::unique_ptr<Bytes>> states_;
};

// Serialised states. They start with a header of kind, version, model, length and checksum, so that foreign
// and damaged bytes are refused.
namespace serial {
Bytes header(const std::string& guid, const Bytes& state);
// Reads the state in `bytes`. Returns why they are invalid, null on success.
const char* read(const std::string& guid, const unsigned char* bytes, std::size_t size, Bytes& state);
}  // namespace serial

}  // namespace redysim
