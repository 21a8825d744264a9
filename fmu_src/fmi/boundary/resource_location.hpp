#pragma once

#include <string>
#include <vector>

namespace redysim {

// The folders that a resource location may mean, best guess first. Importers send file:///, file:/,
// file:////, file://localhost/ or a plain path, percent-encoded or not; folder names may hold "%20" itself.
std::vector<std::string> resource_folders(const char* location);

// The resources folder of the unpacked FMU that this library was loaded from; empty if unknown.
std::string own_resource_folder();

}  // namespace redysim
