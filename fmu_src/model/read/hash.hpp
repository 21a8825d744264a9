#pragma once

#include <cstddef>
#include <cstdint>

namespace redysim {

inline constexpr std::uint64_t fnv1a_basis = 0xcbf29ce484222325u;

// 64-bit FNV-1a; `state`: hash of the preceding bytes.
inline std::uint64_t fnv1a(const unsigned char* bytes, std::size_t size, std::uint64_t state = fnv1a_basis) {
  for (std::size_t i = 0; i < size; ++i) state = (state ^ bytes[i]) * 0x100000001b3u;
  return state;
}

}  // namespace redysim
