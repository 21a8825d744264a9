#pragma once

// A function is compiled once for any x86-64 processor and once, with all functions it calls, for processors
// with AVX2 and FMA (two to three times as fast). Other platforms have one version.
//
// Calls in the plain version of `fastest` are not inlined: half the size, 10 % slower. REDYSIM_CLONES
// compiles one body twice, and the loader selects the version.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define REDYSIM_TWO_VERSIONS
#define REDYSIM_CLONES __attribute__((flatten, target_clones("arch=x86-64-v3", "default")))
#define REDYSIM_AVX2 __attribute__((flatten, target("arch=x86-64-v3")))
namespace redysim {
extern const bool has_avx2;  // all features of x86-64-v3
}
#else
#define REDYSIM_CLONES
#define REDYSIM_AVX2
namespace redysim {
constexpr bool has_avx2 = false;
}
#endif

namespace redysim {

template <class Body>
REDYSIM_AVX2 void with_avx2(const Body& body) {
  body();
}

// Executes body(), compiled for this processor.
template <class Body>
void fastest(const Body& body) {
  if (has_avx2)
    with_avx2(body);
  else
    body();
}

}  // namespace redysim
