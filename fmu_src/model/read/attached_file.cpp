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
  for (const AttachedFile& known : files)
    if (known.name == name) return &known;
  AttachedFile read{name, {}};
  const char* const why =
      is_file_name(name) ? read_file(folder + name, read.bytes) : "has a name that is not allowed";
  if (why) {
    section.error("file", "file '" + name + "' " + why + "; it must be a file beside the model file");
    return nullptr;
  }
  if (read.bytes.rfind("\xEF\xBB\xBF", 0) == 0)
    read.bytes.erase(0, 3);  // the byte order mark of spreadsheets
  files.push_back(std::move(read));
  return &files.back();
}

}  // namespace redysim
