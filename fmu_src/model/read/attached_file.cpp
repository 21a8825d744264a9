#include "model/read/attached_file.hpp"

#include <utility>

#include "model/read/open_file.hpp"

namespace redysim {
namespace {

bool is_file_name(const std::string& name) {
  return !name.empty() && name[0] != '.' && name.find_first_of("/\\:") == std::string::npos &&
         name != "model.toml";
}

}  // namespace

const AttachedFile* attach(Section& section, const std::string& folder, std::vector<AttachedFile>& files) {
  const std::string name = section.text("file");
  if (!is_file_name(name)) {
    section.error("file", "file '" + name + "' must be the name of a file in the model file's folder");
    return nullptr;
  }
  for (const AttachedFile& known : files)
    if (known.name == name) return &known;
  AttachedFile read{name, {}};
  if (const char* why = read_file(folder + name, read.bytes)) {
    section.error("file", "file '" + name + "' " + why + "; it must be a file beside the model file");
    return nullptr;
  }
  files.push_back(std::move(read));
  return &files.back();
}

}  // namespace redysim
