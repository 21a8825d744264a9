#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>

// Counts what the whole program allocates, operator new included, by standing before libc's malloc. Weak, so
// that several test files may include it; left out where a sanitizer needs the place itself (then 0 always).

namespace redysim::test {
inline std::atomic<long> allocations{0};
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__GLIBC__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
__attribute__((weak)) void* malloc(std::size_t size) noexcept {
  ++redysim::test::allocations;
  return __libc_malloc(size);
}
__attribute__((weak)) void* calloc(std::size_t count, std::size_t size) noexcept {
  ++redysim::test::allocations;
  return __libc_calloc(count, size);
}
__attribute__((weak)) void* realloc(void* old, std::size_t size) noexcept {
  ++redysim::test::allocations;
  return __libc_realloc(old, size);
}
}
#endif
