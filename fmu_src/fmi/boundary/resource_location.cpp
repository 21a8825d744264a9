#include "fmi/boundary/resource_location.hpp"

#include "model/any_of.hpp"

#ifdef _WIN32
#include <windows.h>
#elif defined(__APPLE__)
#include <dlfcn.h>
#elif !defined(__EMSCRIPTEN__)
#include <link.h>
#endif

#include <algorithm>
#include <cstdint>

namespace redysim {
namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string decoded(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = i + 2 < text.size() && text[i] == '%' ? hex_digit(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
    if (low >= 0 && high + low > 0) {
      result += static_cast<char>(16 * high + low);
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

bool starts_with(const std::string& text, const char* prefix, std::size_t length) {
  if (text.size() < length) return false;
  return std::equal(prefix, prefix + length, text.begin(),
                    [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b - 'A' + 'a' : b); });
}

void add(std::vector<std::string>& list, std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  if (!path.empty() && !contains(list, path)) list.push_back(std::move(path));
}

}  // namespace

std::vector<std::string> resource_folders(const char* location) {
  std::vector<std::string> folders;
  if (!location) return folders;
  std::string path = location;
  const bool is_uri = starts_with(path, "file:", 5);
  if (is_uri) {
    path.erase(0, 5);
    if (starts_with(path, "//localhost/", 12)) path.erase(0, 11);
    // any number of slashes starts an absolute path, none a relative path
    const std::size_t first = path.find_first_not_of('/');
    if (first != std::string::npos && first > 1) path.erase(0, first - 1);
#ifdef _WIN32
    // a drive replaces the root: /C:/folder or /C|/folder
    if (path.size() > 2 && path[0] == '/' && (path[2] == ':' || path[2] == '|')) {
      path.erase(0, 1);
      path[1] = ':';
    }
#endif
  }
  const std::string plain = is_uri ? decoded(path) : path;
  add(folders, plain);
  add(folders, is_uri ? path : decoded(path));
  return folders;
}

#ifdef _WIN32
std::string own_resource_folder() {
  HMODULE library = nullptr;  // <fmu>/binaries/win64/<name>.dll, which contains this function
  if (!GetModuleHandleExW(
          GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
          reinterpret_cast<LPCWSTR>(&own_resource_folder), &library))
    return {};
  std::wstring wide(32768, L'\0');  // maximum path length of Windows
  const DWORD length = GetModuleFileNameW(library, wide.data(), static_cast<DWORD>(wide.size()));
  std::string path(4 * static_cast<std::size_t>(length), '\0');
  path.resize(static_cast<std::size_t>(WideCharToMultiByte(CP_UTF8, 0, wide.data(), static_cast<int>(length),
                                                           path.data(), static_cast<int>(path.size()),
                                                           nullptr, nullptr)));
  const std::size_t slash = path.find_last_of("/\\");
  return (slash == std::string::npos ? std::string(".") : path.substr(0, slash)) + "/../../resources";
}
#elif defined(__APPLE__)
std::string own_resource_folder() {
  Dl_info library;  // <fmu>/binaries/darwin64/<name>.dylib
  if (!dladdr(reinterpret_cast<const void*>(&own_resource_folder), &library) || !library.dli_fname) return {};
  const std::string path = library.dli_fname;
  const std::size_t slash = path.rfind('/');
  return (slash == std::string::npos ? std::string(".") : path.substr(0, slash)) + "/../../resources";
}
#elif defined(__EMSCRIPTEN__)
std::string own_resource_folder() { return {}; }  // the library is not in a file
#else
std::string own_resource_folder() {
  // the loaded object that contains this function
  struct Search {
    std::uintptr_t here;
    std::string library;  // <fmu>/binaries/linux64/<name>.so
  } search{reinterpret_cast<std::uintptr_t>(&own_resource_folder), {}};
  dl_iterate_phdr(
      [](dl_phdr_info* object, std::size_t, void* data) {
        auto& wanted = *static_cast<Search*>(data);
        for (int i = 0; i < object->dlpi_phnum; ++i) {
          const ElfW(Phdr)& segment = object->dlpi_phdr[i];
          if (segment.p_type != PT_LOAD) continue;
          if (wanted.here - (object->dlpi_addr + segment.p_vaddr) >= segment.p_memsz) continue;
          wanted.library = object->dlpi_name;
          return 1;
        }
        return 0;
      },
      &search);
  if (search.library.empty()) return {};
  const std::size_t slash = search.library.rfind('/');
  return (slash == std::string::npos ? std::string(".") : search.library.substr(0, slash)) +
         "/../../resources";
}
#endif

}  // namespace redysim
