// Makes the library loadable with glibc 2.17 (2012) or newer, although it is linked with a newer one.
// Functions renewed since then are bound to their first version or defined here. All definitions are hidden,
// so they serve this library only.

#include <cstdlib>  // names the C library

#if defined(__GLIBC__) && (defined(__x86_64__) || defined(__aarch64__))

#include <elf.h>
#include <link.h>
#include <sched.h>
#include <sys/stat.h>

#include <cstdint>

// C functions whose errno handling 2.29 and 2.35 removed; the values are the same
#ifdef __x86_64__
#define REDYSIM_FIRST_VERSION(name) __asm__(".symver redysim_" #name ", " #name "@GLIBC_2.2.5")
#else
#define REDYSIM_FIRST_VERSION(name) __asm__(".symver redysim_" #name ", " #name "@GLIBC_2.17")
#endif
REDYSIM_FIRST_VERSION(exp);
REDYSIM_FIRST_VERSION(log);
REDYSIM_FIRST_VERSION(pow);
REDYSIM_FIRST_VERSION(hypot);
// fstat used it before 2.33
REDYSIM_FIRST_VERSION(__fxstat);

#define REDYSIM_OURS(name) __asm__(#name) __attribute__((visibility("hidden")))

extern "C" {

double redysim_exp(double);
double redysim_log(double);
double redysim_pow(double, double);
double redysim_hypot(double, double);
// NOLINTNEXTLINE(bugprone-reserved-identifier)
int redysim___fxstat(int version, int descriptor, struct stat* status);

double our_exp(double x) REDYSIM_OURS(exp);
double our_log(double x) REDYSIM_OURS(log);
double our_pow(double x, double y) REDYSIM_OURS(pow);
double our_hypot(double x, double y) REDYSIM_OURS(hypot);

double our_exp(double x) { return redysim_exp(x); }
double our_log(double x) { return redysim_log(x); }
double our_pow(double x, double y) { return redysim_pow(x, y); }
double our_hypot(double x, double y) { return redysim_hypot(x, y); }

int our_fstat(int descriptor, struct stat* status) REDYSIM_OURS(fstat);
int our_fstat(int descriptor, struct stat* status) {
#ifdef __x86_64__
  constexpr int kernels = 1;
#else
  constexpr int kernels = 0;
#endif
  return redysim___fxstat(kernels, descriptor, status);
}

// if true, libstdc++ counts references without atomics (2.32); atomics are always correct
extern char our_single_threaded REDYSIM_OURS(__libc_single_threaded);
char our_single_threaded = 0;

// libgcc's unwinder initialises its tables with it (in libc since 2.34; before in libpthread, which may be
// absent)
int our_pthread_once(int* control, void (*routine)()) REDYSIM_OURS(pthread_once);
int our_pthread_once(int* control, void (*routine)()) {
  enum { untouched = 0, running = 1, done = 2 };
  int seen = untouched;
  if (__atomic_compare_exchange_n(control, &seen, running, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) {
    routine();
    __atomic_store_n(control, done, __ATOMIC_RELEASE);
    return 0;
  }
  while (__atomic_load_n(control, __ATOMIC_ACQUIRE) != done) sched_yield();
  return 0;
}

// libgcc only checks whether it exists
int our_pthread_key_create() REDYSIM_OURS(__pthread_key_create);
int our_pthread_key_create() { return 0; }

// libgcc's unwinder finds the unwind table of the code at `pc` with it (2.35)
struct FoundObject {  // struct dl_find_object of both architectures
  unsigned long long flags;
  void* map_start;
  void* map_end;
  void* link_map;
  const void* eh_frame;
  unsigned long long reserved[7];
};
int our_dl_find_object(void* pc, FoundObject* found) REDYSIM_OURS(_dl_find_object);
int our_dl_find_object(void* pc, FoundObject* found) {
  struct Search {
    std::uintptr_t pc;
    FoundObject* found;
  } search{reinterpret_cast<std::uintptr_t>(pc), found};
  const auto visit = [](dl_phdr_info* object, std::size_t, void* data) {
    auto& wanted = *static_cast<Search*>(data);
    const ElfW(Phdr)* table = nullptr;
    bool inside = false;
    for (int i = 0; i < object->dlpi_phnum; ++i) {
      const ElfW(Phdr)& segment = object->dlpi_phdr[i];
      if (segment.p_type == PT_GNU_EH_FRAME) table = &segment;
      if (segment.p_type == PT_LOAD && wanted.pc - (object->dlpi_addr + segment.p_vaddr) < segment.p_memsz)
        inside = true;
    }
    if (!inside || !table) return 0;
    *wanted.found = {};
    wanted.found->eh_frame = reinterpret_cast<const void*>(object->dlpi_addr + table->p_vaddr);
    return 1;
  };
  return dl_iterate_phdr(visit, &search) == 1 ? 0 : -1;
}

}  // extern "C"

#endif
