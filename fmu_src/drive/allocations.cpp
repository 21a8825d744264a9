#include "drive/allocations.hpp"

#include <malloc.h>

#include <atomic>
#include <cstddef>

#ifndef REDYSIM_SANITIZED

// These stand before libc's for every library that is loaded; glibc exports its own under second names.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
}

namespace {
std::atomic<long> count{0};
}

extern "C" {
void* malloc(std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(number, size);
}
void* realloc(void* old, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(old, size);
}
}

long redysim::drive::allocations() { return count.load(std::memory_order_relaxed); }

#else

long redysim::drive::allocations() { return -1; }

#endif

double redysim::drive::heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}
