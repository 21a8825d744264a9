#pragma once

#include <cstdio>
#include <string>

namespace redysim {

// Opens a file to read its bytes; null if that cannot be. The path is UTF-8 on every system.
std::FILE* open_file(const std::string& path);

}  // namespace redysim
