#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

namespace redysim {

// Why arrays of `count` entries of up to eight bytes cannot be what a master gave; null: they may be. A count
// such as (size_t)-1 is refused before anything is read or written behind the arrays.
inline const char* objection_to_arrays(std::size_t count, std::initializer_list<const void*> arrays) {
  if (count == 0) return nullptr;
  for (const void* array : arrays)
    if (!array) return "an argument is a null pointer";
  if (count > PTRDIFF_MAX / sizeof(double)) return "no array has as many entries as were given";
  return nullptr;
}

}  // namespace redysim
