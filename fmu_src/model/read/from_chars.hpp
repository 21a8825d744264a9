#pragma once

// Declares functions missing in Emscripten's libc++. from_chars.cpp defines from_chars; to_chars is used only
// by functions of toml++ that are never called. CMake includes this file before each file of the model
// reader.

#include <charconv>

namespace std {

from_chars_result from_chars(const char* first, const char* last, double& value,
                             chars_format format = chars_format::general) noexcept;
to_chars_result to_chars(char* first, char* last, double value);
to_chars_result to_chars(char* first, char* last, double value, chars_format format);
to_chars_result to_chars(char* first, char* last, double value, chars_format format, int precision);

}  // namespace std
