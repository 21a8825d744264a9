#include "model/open_file.hpp"

#ifdef _WIN32
#include <windows.h>
#endif

namespace redysim {

#ifdef _WIN32
// Windows takes the bytes of a narrow name as the machine's code page
std::FILE* open_file(const std::string& path) {
  const int length = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path.c_str(), -1, nullptr, 0);
  if (length <= 0) return nullptr;
  std::wstring wide(static_cast<std::size_t>(length), L'\0');
  MultiByteToWideChar(CP_UTF8, 0, path.c_str(), -1, wide.data(), length);
  return _wfopen(wide.c_str(), L"rb");
}
#else
std::FILE* open_file(const std::string& path) { return std::fopen(path.c_str(), "rb"); }
#endif

}  // namespace redysim
