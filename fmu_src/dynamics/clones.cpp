#include "dynamics/clones.hpp"

#ifdef REDYSIM_TWO_VERSIONS

#include <cpuid.h>

namespace redysim {

namespace {

// Whether the processor has all instructions of x86-64-v3 and the operating system saves their registers.
// libgcc's own test covers all processors and is 5 kB larger.
bool has_x86_64_v3() {
  constexpr unsigned first = bit_SSE3 | bit_SSSE3 | bit_FMA | bit_CMPXCHG16B | bit_SSE4_1 | bit_SSE4_2 |
                             bit_MOVBE | bit_POPCNT | bit_OSXSAVE | bit_AVX | bit_F16C;
  constexpr unsigned seventh = bit_BMI | bit_AVX2 | bit_BMI2, extended = bit_LZCNT | bit_LAHF_LM;
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (!__get_cpuid(1, &a, &b, &c, &d) || (c & first) != first) return false;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & seventh) != seventh) return false;
  if (!__get_cpuid(0x80000001, &a, &b, &c, &d) || (c & extended) != extended) return false;
  constexpr unsigned registers = 6;  // XMM and YMM
  __asm__("xgetbv" : "=a"(a), "=d"(d) : "c"(0));
  return (a & registers) == registers;
}

}  // namespace

const bool has_avx2 = has_x86_64_v3();

}  // namespace redysim

#endif
