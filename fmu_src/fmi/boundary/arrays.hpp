#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

namespace redysim {

inline constexpr const char* null_pointer = "an argument is a null pointer";

// Why arrays with `count` entries of up to eight bytes cannot exist; null: they can. This refuses counts such
// as (size_t)-1 before any access beyond the arrays.
inline const char* objection_to_arrays(std::size_t count, std::initializer_list<const void*> arrays) {
  if (count == 0) return nullptr;
  for (const void* array : arrays)
    if (!array) return null_pointer;
  if (count > PTRDIFF_MAX / sizeof(double)) return "the number of entries exceeds the address space";
  return nullptr;
}

}  // namespace redysim
