#include "model/read/fingerprint.hpp"

#include <cstdint>

namespace redysim {
namespace {

// FNV-1a over the interface version and the bytes, then MurmurHash3's final mix.
std::uint64_t hash(const std::string& source, std::uint64_t basis) {
  const auto add = [](std::uint64_t state, unsigned char byte) { return (state ^ byte) * 0x100000001b3u; };
  std::uint64_t state = basis;
  for (int shift = 0; shift < 32; shift += 8)
    state = add(state, static_cast<unsigned char>(interface_version >> shift));
  for (const char byte : source) state = add(state, static_cast<unsigned char>(byte));
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
  const std::string digits = hex(hash(source, 0xcbf29ce484222325u)) + hex(hash(source, 0x84222325cbf29ce4u));
  return "{" + digits.substr(0, 8) + "-" + digits.substr(8, 4) + "-" + digits.substr(12, 4) + "-" +
         digits.substr(16, 4) + "-" + digits.substr(20) + "}";
}

}  // namespace redysim
