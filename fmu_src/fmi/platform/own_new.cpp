// On macOS a library that is linked statically with libc++ would export its operators new and delete, and the
// loader would share them among all libraries. These operators are hidden
// (-fvisibility-global-new-delete=force-hidden) and serve this library only. All must be defined here;
// otherwise the linker would also use those of libc++.

#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

void* memory_or_null(std::size_t size, std::size_t alignment) {
  if (size == 0) size = 1;
  if (alignment <= alignof(std::max_align_t)) return std::malloc(size);
  void* place = nullptr;
  return posix_memalign(&place, alignment, size) == 0 ? place : nullptr;
}

void* memory(std::size_t size, std::size_t alignment) {
  void* place = memory_or_null(size, alignment);
  if (!place) throw std::bad_alloc();
  return place;
}

}  // namespace

void* operator new(std::size_t size) { return memory(size, 0); }
void* operator new[](std::size_t size) { return memory(size, 0); }
void* operator new(std::size_t size, std::align_val_t at) {
  return memory(size, static_cast<std::size_t>(at));
}
void* operator new[](std::size_t size, std::align_val_t at) {
  return memory(size, static_cast<std::size_t>(at));
}

void operator delete(void* place) noexcept { std::free(place); }
void operator delete[](void* place) noexcept { std::free(place); }
void operator delete(void* place, std::size_t) noexcept { std::free(place); }
void operator delete[](void* place, std::size_t) noexcept { std::free(place); }
void operator delete(void* place, std::align_val_t) noexcept { std::free(place); }
void operator delete[](void* place, std::align_val_t) noexcept { std::free(place); }
void operator delete(void* place, std::size_t, std::align_val_t) noexcept { std::free(place); }
void operator delete[](void* place, std::size_t, std::align_val_t) noexcept { std::free(place); }

void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return memory_or_null(size, 0); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return memory_or_null(size, 0); }
void* operator new(std::size_t size, std::align_val_t at, const std::nothrow_t&) noexcept {
  return memory_or_null(size, static_cast<std::size_t>(at));
}
void* operator new[](std::size_t size, std::align_val_t at, const std::nothrow_t&) noexcept {
  return memory_or_null(size, static_cast<std::size_t>(at));
}
void operator delete(void* place, const std::nothrow_t&) noexcept { std::free(place); }
void operator delete[](void* place, const std::nothrow_t&) noexcept { std::free(place); }
void operator delete(void* place, std::align_val_t, const std::nothrow_t&) noexcept { std::free(place); }
void operator delete[](void* place, std::align_val_t, const std::nothrow_t&) noexcept { std::free(place); }
