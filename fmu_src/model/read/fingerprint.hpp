#pragma once

#include <string>

namespace redysim {

// Must be increased when the variables or their meaning change for an unchanged model file.
inline constexpr unsigned interface_version = 2;

// 128-bit hash of a model file's bytes as a GUID, "{xxxxxxxx-xxxx-xxxx-xxxx-xxxxxxxxxxxx}". It is the same on
// every machine and differs for another file or another interface_version.
std::string fingerprint(const std::string& source);

}  // namespace redysim
