#include "fmi/boundary/load_model.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <utility>
#include <vector>

#include "dynamics/straight_line/straight_line.hpp"
#include "fmi/boundary/resource_location.hpp"
#include "model/features.hpp"
#include "model/read/fingerprint.hpp"
#include "model/read/model_file.hpp"
#include "model/read/open_file.hpp"

namespace redysim {
namespace {

// The model file of the unpacked FMU; empty, with the reason logged, if there is none.
std::string find_model_file(const Log& log, const char* function, const char* location) {
  std::vector<std::string> folders = resource_folders(location);
  const std::string own = own_resource_folder();
  if (!own.empty()) folders.push_back(own);
  std::string tried;
  for (const std::string& folder : folders) {
    const std::string path = folder + "/model.toml";
    const char* why = nullptr;
    if (std::FILE* file = open_file(path, why)) {
      std::fclose(file);
      log.event("reading '" + path + "'");
      return path;
    }
    tried += (tried.empty() ? "'" : ", '") + path + "' " + why;
  }
  log.error(std::string(function) + ": cannot read a model file: " + tried);
  return {};
}

// GUIDs are hexadecimal numbers; tools write them in upper or lower case.
bool is_same_guid(const std::string& own, const std::string& given) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(own.begin(), own.end(), given.begin(), given.end(),
                    [lower](char a, char b) { return lower(a) == lower(b); });
}

// The standard requires at least one character that is not white space.
bool is_a_name(const char* text) { return text && text[std::strspn(text, " \t\n\v\f\r")] != '\0'; }

// First mismatch between a specialised library and the scene, as a sentence; empty: none.
std::string objection_of_library(const Model& model, const std::string& guid, const std::string& path) {
  if constexpr (features::straight_line) {
    if (guid != straight_line_scene)
      return "this library was specialised for another scene than '" + path + "'";
  }
  const std::string missing = missing_feature(model);
  if (missing.empty()) return {};
  return "this library was specialised for another scene, without " + missing + ", which '" + path + "' uses";
}

}  // namespace

std::optional<LoadedModel> load_model(const Log& log, const char* function, const char* instance_name,
                                      const char* guid, const char* location) {
  const auto refuse = [&](const std::string& why) {
    log.error(std::string(function) + ": " + why);
    return std::nullopt;
  };
  if (!is_a_name(instance_name)) return refuse("the instance has no name");
  const std::string path = find_model_file(log, function, location);
  if (path.empty()) return std::nullopt;
  ModelFile file = read_model_file(path);
  for (const Diagnostic& warning : file.warnings) log.warning(warning.text());
  std::string own_guid = fingerprint(file.source);
  if (!guid || !is_same_guid(own_guid, guid))
    return refuse("the GUID " + std::string(guid ? guid : "(null)") + " differs from that of '" + path +
                  "', " + own_guid + ": modelDescription.xml belongs to another model file");
  const std::string objection = objection_of_library(file.model, own_guid, path);
  if (!objection.empty()) return refuse(objection);
  return LoadedModel{std::move(file.model), std::move(own_guid)};
}

void log_exception(const Log& log, const char* function) noexcept {
  try {
    try {
      throw;
    } catch (const ModelError& error) {
      for (const Diagnostic& diagnostic : error.diagnostics())
        log.error(std::string(function) + ": " + diagnostic.text());
    } catch (const std::bad_alloc&) {
      log.error(std::string(function) + ": out of memory");
    } catch (const std::exception& error) {
      log.error(std::string(function) + ": " + error.what());
    }
  } catch (...) {
  }
}

}  // namespace redysim
