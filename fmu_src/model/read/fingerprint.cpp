#include "model/read/fingerprint.hpp"

#include <cstdint>

#include "model/read/hash.hpp"

namespace redysim {
namespace {

// FNV-1a over the interface version and the bytes, then the final mixing of MurmurHash3.
std::uint64_t hash(const std::string& source, std::uint64_t basis) {
  unsigned char version[4];
  for (int i = 0; i < 4; ++i) version[i] = static_cast<unsigned char>(interface_version >> (8 * i));
  std::uint64_t state = fnv1a(version, sizeof version, basis);
  state = fnv1a(reinterpret_cast<const unsigned char*>(source.data()), source.size(), state);
  state = (state ^ (state >> 33)) * 0xff51afd7ed558ccdu;
  state = (state ^ (state >> 33)) * 0xc4ceb9fe1a85ec53u;
  return state ^ (state >> 33);
}

std::string hex(std::uint64_t number) {
  std::string digits(16, '0');
  for (int i = 15; i >= 0; --i, number >>= 4)
    digits[static_cast<std::size_t>(i)] = "0123456789abcdef"[number & 15];
  return digits;
}

}  // namespace

std::string fingerprint(const std::string& source) {
  const std::string digits = hex(hash(source, fnv1a_basis)) + hex(hash(source, 0x84222325cbf29ce4u));
  return "{" + digits.substr(0, 8) + "-" + digits.substr(8, 4) + "-" + digits.substr(12, 4) + "-" +
         digits.substr(16, 4) + "-" + digits.substr(20) + "}";
}

}  // namespace redysim
