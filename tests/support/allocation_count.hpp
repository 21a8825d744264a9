#pragma once

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

// Counts the allocations of the whole program, operator new and aligned ones included: these functions
// replace those of libc. Weak, so that several test files may include it. Omitted where a sanitizer replaces
// them itself (the count is 0 then).

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__GLIBC__)
#define REDYSIM_COUNTS_ALLOCATIONS 1
#else
#define REDYSIM_COUNTS_ALLOCATIONS 0
#endif

namespace redysim::test {
inline std::atomic<long> allocations{0};
inline constexpr bool counts_allocations = REDYSIM_COUNTS_ALLOCATIONS;
}  // namespace redysim::test

#if REDYSIM_COUNTS_ALLOCATIONS
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
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
__attribute__((weak)) void* memalign(std::size_t alignment, std::size_t size) noexcept {
  ++redysim::test::allocations;
  return __libc_memalign(alignment, size);
}
__attribute__((weak)) void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++redysim::test::allocations;
  return __libc_memalign(alignment, size);
}
__attribute__((weak)) int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  ++redysim::test::allocations;
  void* given = __libc_memalign(alignment, size);
  if (!given) return ENOMEM;
  *block = given;
  return 0;
}
}
#endif
