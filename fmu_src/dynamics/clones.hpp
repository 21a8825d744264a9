#pragma once

// A function compiled once for any x86-64 and once for processors with AVX2 and FMA (two to three times as
// fast); the loader selects the version. On other platforms there is one version.
//
// REDYSIM_CLONES compiles one body twice. REDYSIM_AVX2 and REDYSIM_PLAIN mark two bodies of one function that
// is called in its own file only: calls in the plain version are not inlined, which halves its size and costs
// 10 % of speed.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define REDYSIM_CLONES __attribute__((flatten, target_clones("arch=x86-64-v3", "default")))
#define REDYSIM_AVX2 __attribute__((flatten, target("arch=x86-64-v3")))
#define REDYSIM_PLAIN __attribute__((target("default")))
#else
#define REDYSIM_CLONES
#define REDYSIM_PLAIN
#endif
