#pragma once

// A function compiled once for any x86-64 and once, with all that it calls, for processors with AVX2 and FMA
// (two to three times as fast). On other platforms there is one version.
//
// Calls in the plain version of `fastest` are not inlined, which halves its size and costs 10 % of speed.
// REDYSIM_CLONES compiles one body twice, and the loader selects the version.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define REDYSIM_TWO_VERSIONS
#define REDYSIM_CLONES __attribute__((flatten, target_clones("arch=x86-64-v3", "default")))
#define REDYSIM_AVX2 __attribute__((flatten, target("arch=x86-64-v3")))
namespace redysim {
extern const bool has_avx2;  // and the rest of x86-64-v3
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

// body(), compiled for this processor.
template <class Body>
void fastest(const Body& body) {
  if (has_avx2)
    with_avx2(body);
  else
    body();
}

}  // namespace redysim
