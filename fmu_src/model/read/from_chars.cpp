// toml++ reads the numbers of a model with from_chars. libstdc++'s version for floating point adds 21 kB of
// tables and long arithmetic, and Emscripten's libc++ has none. The strtod of glibc and musl also rounds
// correctly, so the numbers are the same. The function is not exported: it serves this library only.

#include <cerrno>
#include <charconv>

#if defined(__GLIBC__) || defined(__EMSCRIPTEN__)

#include <clocale>
#include <cmath>
#include <cstdlib>
#include <cstring>

#if defined(__GLIBC__) && defined(__x86_64__)
#include <fpu_control.h>
#endif

namespace {

// strtod of glibc rounds as the x87 unit, which FloatMode leaves to the host.
class RoundToNearest {
#if defined(__GLIBC__) && defined(__x86_64__)
 public:
  RoundToNearest() {
    fpu_control_t nearest = _FPU_DEFAULT;
    _FPU_GETCW(theirs_);
    _FPU_SETCW(nearest);
  }
  ~RoundToNearest() { _FPU_SETCW(theirs_); }
  RoundToNearest(const RoundToNearest&) = delete;
  RoundToNearest& operator=(const RoundToNearest&) = delete;

 private:
  fpu_control_t theirs_;
#endif
};

}  // namespace

namespace std {

// Reads decimal numbers of at most 1000 characters, without infinities and NaN.
from_chars_result from_chars(const char* first, const char* last, double& value, chars_format) noexcept {
  char text[1001];
  size_t length = 0;
  while (first + length != last && length < sizeof text - 1 && strchr("0123456789.eE+-", first[length]))
    ++length;
  if (length == 0 || *first == '+') return {first, errc::invalid_argument};
  memcpy(text, first, length);
  text[length] = '\0';
  char* end = text;
  const int before = errno;
  errno = 0;
  [[maybe_unused]] const RoundToNearest mode;
  const double number = strtod_l(text, &end, newlocale(LC_ALL_MASK, "C", nullptr));  // a constant
  // subnormal numbers also set ERANGE
  const bool in_range = errno != ERANGE || (number != 0 && !isinf(number));
  errno = before;
  if (end == text) return {first, errc::invalid_argument};
  const char* const behind = first + (end - text);
  if (!in_range) return {behind, errc::result_out_of_range};
  value = number;
  return {behind, errc()};
}

}  // namespace std

#endif
