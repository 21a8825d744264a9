#include "model/read/names.hpp"

#include "model/model.hpp"
#include "model/read/suggest.hpp"

namespace redysim {
namespace {

bool is_reserved(const std::string& name) {
  return name == "time" || name == "energy" || name == "solver" || name == "gravity" || name == "ground" ||
         name == "independent" || name == "state";
}

}  // namespace

std::string label_of(const std::string& kind, std::size_t ordinal, const Value& table) {
  const Value* name = table.find("name");
  if (!name || name->kind != Value::Kind::text || name->text.empty())
    return kind + " " + std::to_string(ordinal);
  return kind + " '" + name->text + "'";
}

std::string Names::take(Section& section, const std::string& owner) {
  const std::string name = section.identifier("name");
  section.require("name");
  if (!name.empty()) claim(name, "name", owner, section);
  return name;
}

void Names::claim(const std::string& name, std::string_view key, const std::string& owner, Section& section) {
  if (is_reserved(name)) {
    section.error(key, std::string(key) + " '" + name + "' is reserved");
    return;
  }
  const auto [found, is_new] = owners_.insert({name, {owner, section.place(key).line}});
  if (is_new) return;
  section.error(key, std::string(key) + " '" + name + "' is already used by " + found->second.label +
                         " (line " + std::to_string(found->second.line) + ")");
}

void LinkIndex::add(const std::string& name, int index) {
  if (indices_.insert({name, index}).second) candidates_.push_back(name);
}

int LinkIndex::find(const std::string& name, std::string_view key, Section& section, int fallback) const {
  if (name == "ground") return ground;
  const auto found = indices_.find(name);
  if (found != indices_.end()) return found->second;
  section.error(key, std::string(key) + " '" + name + "' is not a link" + did_you_mean(name, candidates_));
  return fallback;
}

}  // namespace redysim
