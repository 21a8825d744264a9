#include "model/read/open_file.hpp"

#include <cerrno>

#ifdef _WIN32
#include <windows.h>
#elif !defined(__EMSCRIPTEN__)
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace redysim {
namespace {

constexpr const char* missing = "does not exist";
constexpr const char* unreadable = "cannot be read";

}  // namespace

#ifdef _WIN32
// Windows interprets narrow file names in the code page of the machine.
std::FILE* open_file(const std::string& path, const char*& why) {
  why = unreadable;
  const int length = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path.c_str(), -1, nullptr, 0);
  if (length <= 0) return nullptr;
  std::wstring wide(static_cast<std::size_t>(length), L'\0');
  MultiByteToWideChar(CP_UTF8, 0, path.c_str(), -1, wide.data(), length);
  std::FILE* file = _wfopen(wide.c_str(), L"rb");
  if (!file && errno == ENOENT) why = missing;
  return file;
}
#elif defined(__EMSCRIPTEN__)
// Functions of the web page: size of a file, or -1 if it does not exist, and its bytes.
extern "C" {
__attribute__((import_module("host"), import_name("file_size"))) int redysim_host_file_size(const char* path);
__attribute__((import_module("host"), import_name("file_bytes"))) void redysim_host_file_bytes(
    const char* path, char* bytes);
}

std::FILE* open_file(const std::string& path, const char*& why) {
  const int size = redysim_host_file_size(path.c_str());
  why = size < 0 ? missing : unreadable;
  if (size < 0) return nullptr;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  redysim_host_file_bytes(path.c_str(), bytes.data());
  std::FILE* file = fmemopen(nullptr, bytes.size() + 1, "w+");
  if (!file) return nullptr;
  const bool whole = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  std::rewind(file);
  if (whole) return file;
  std::fclose(file);
  return nullptr;
}
#else
std::FILE* open_file(const std::string& path, const char*& why) {
  // without O_NONBLOCK, open() would wait for a writer of a named pipe
  const int descriptor = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  why = errno == ENOENT ? missing : unreadable;
  if (descriptor < 0) return nullptr;
  struct stat status;
  const bool regular = fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  why = regular ? unreadable : "is not a regular file";
  std::FILE* file = regular ? fdopen(descriptor, "rb") : nullptr;
  if (!file) close(descriptor);
  return file;
}
#endif

const char* read_file(const std::string& path, std::string& bytes) {
  const char* why = nullptr;
  std::FILE* file = open_file(path, why);
  if (!file) return why;
  char block[4096];
  while (const std::size_t count = std::fread(block, 1, sizeof block, file)) bytes.append(block, count);
  const bool good = std::ferror(file) == 0;
  std::fclose(file);
  return good ? nullptr : unreadable;
}

}  // namespace redysim
