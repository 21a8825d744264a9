#include "allocations.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>

// These stand before libc's for every library that is loaded; glibc exports its own under second names.
// In front of each block stands what was asked for, so that the count is exact.
extern "C" {
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* __libc_malloc(std::size_t size);
void __libc_free(void* base);
}

namespace {

struct Head {
  std::size_t size;    // asked for
  std::size_t offset;  // of the block from what libc gave
};
constexpr std::size_t smallest_offset = sizeof(Head);
static_assert(smallest_offset % alignof(std::max_align_t) == 0, "blocks stay aligned");

std::atomic<long> count{0}, bytes{0};

Head& head_of(void* block) { return *(static_cast<Head*>(block) - 1); }

void* headed(void* base, std::size_t size, std::size_t offset) {
  count.fetch_add(1, std::memory_order_relaxed);
  if (!base) return nullptr;
  bytes.fetch_add(static_cast<long>(size), std::memory_order_relaxed);
  void* block = static_cast<char*>(base) + offset;
  head_of(block) = {size, offset};
  return block;
}

void* block_of(std::size_t size) {
  if (size > PTRDIFF_MAX - smallest_offset) return nullptr;
  return headed(__libc_malloc(size + smallest_offset), size, smallest_offset);
}

}  // namespace

extern "C" {
void* malloc(std::size_t size) { return block_of(size); }
void free(void* block) {
  if (!block) return;
  const Head head = head_of(block);
  bytes.fetch_sub(static_cast<long>(head.size), std::memory_order_relaxed);
  __libc_free(static_cast<char*>(block) - head.offset);
}
void* calloc(std::size_t number, std::size_t size) {
  if (size != 0 && number > PTRDIFF_MAX / size) return nullptr;
  void* block = block_of(number * size);
  return block ? std::memset(block, 0, number * size) : nullptr;
}
void* realloc(void* old, std::size_t size) {
  void* block = block_of(size);
  if (!old || !block) return block;
  std::memcpy(block, old, std::min(size, head_of(old).size));
  free(old);
  return block;
}
void* memalign(std::size_t alignment, std::size_t size) {
  const std::size_t offset = std::max(alignment, smallest_offset);
  if (size > PTRDIFF_MAX - offset) return nullptr;
  return headed(__libc_memalign(alignment, size + offset), size, offset);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  *block = memalign(alignment, size);
  return *block ? 0 : ENOMEM;
}
}

long redysim::bench::allocations() { return count.load(std::memory_order_relaxed); }

double redysim::bench::heap_bytes() { return static_cast<double>(bytes.load(std::memory_order_relaxed)); }
