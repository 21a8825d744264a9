#pragma once

// A function compiled once for any x86-64 and once for processors with AVX2 and FMA (about twice as fast);
// the loader takes the right one. Elsewhere there is one version.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define REDYSIM_CLONES __attribute__((flatten, target_clones("arch=x86-64-v3", "default")))
#else
#define REDYSIM_CLONES
#endif
