#pragma once

#include <string>
#include <vector>

namespace redysim {

// Folders that a resource location may mean, most likely first. Importers send file:///, file:/, file:////,
// file://localhost/ or a plain path, percent-encoded or not; folder names may contain "%20" themselves.
std::vector<std::string> resource_folders(const char* location);

// The resources folder of the unpacked FMU from which this library was loaded; empty if unknown.
std::string own_resource_folder();

}  // namespace redysim
