#pragma once

#include <cstdio>
#include <string>

namespace redysim {

// Opens a regular file for reading in binary mode. The path is UTF-8 on every system. Null on failure, with
// the reason in `why`, for example "does not exist".
std::FILE* open_file(const std::string& path, const char*& why);

// Appends the content of a regular file to `bytes`; returns the reason of a failure, or null.
const char* read_file(const std::string& path, std::string& bytes);

}  // namespace redysim
