#include "model/read/toml_value.hpp"

// Some malformed text ("[= 1") violates assertions of toml++ before its own error handling reports the error.
// They are therefore off in every build. Without NDEBUG, toml++ also does not turn them into assumptions.
#undef NDEBUG
#define TOML_ASSERT(condition) static_assert(true)
#define TOML_HEADER_ONLY 1
#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

namespace redysim {
namespace {

Place place_of(const toml::source_region& region) {
  return {static_cast<int>(region.begin.line), static_cast<int>(region.begin.column)};
}

[[noreturn]] void refuse(const std::string& name, Place place, const std::string& message) {
  throw ModelError(ModelError::Reason::syntax, {{name, place.line, place.column, "TOML syntax: " + message}});
}

// The message of toml++, replaced by a simpler one for the most frequent errors.
std::string plain(const std::string& sentence) {
  const auto says = [&sentence](const char* words) { return sentence.find(words) != std::string::npos; };
  if (says("control characters")) return "a string has no closing quotation mark on its line";
  if (says("invalid utf-8")) return "the file is not UTF-8 text; save it as UTF-8";
  if (says("expected a comment or whitespace, saw ','"))
    return "unexpected ',' after a value; write decimal numbers with a point: 1.5";
  if (says("saw ':'")) return "expected '=', saw ':'; a field is written name = value";
  return sentence;
}

// toml++ handles dotted keys by unlimited recursion: a key with 10^5 dots would overflow the stack.
void refuse_deep_keys(const std::string& text, const std::string& name) {
  constexpr int limit = 100;
  int line = 1, dots = 0;
  char before = 0;
  for (const char c : text) {
    if (c == '\n') ++line;
    if (c == '.' && before != '.') ++dots;
    if (c == '\n' || c == ',' || c == '=' || c == '[' || c == '{') dots = 0;
    if (dots > limit) refuse(name, {line, 1}, "a key with more than 100 dots");
    before = c;
  }
}

void convert(const toml::node& node, Value& value) {
  value.place = place_of(node.source());
  if (const auto* text = node.as_string()) {
    value.kind = Value::Kind::text;
    value.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    value.kind = Value::Kind::number;
    value.number = static_cast<double>(integer->get());
  } else if (const auto* number = node.as_floating_point()) {
    value.kind = Value::Kind::number;
    value.number = number->get();
  } else if (const auto* flag = node.as_boolean()) {
    value.kind = Value::Kind::flag;
    value.flag = flag->get();
  } else if (const auto* list = node.as_array()) {
    value.kind = Value::Kind::list;
    value.items.resize(list->size());
    for (std::size_t i = 0; i < list->size(); ++i) convert((*list)[i], value.items[i]);
  } else if (const auto* table = node.as_table()) {
    value.kind = Value::Kind::table;
    value.entries.reserve(table->size());
    for (const auto& [key, item] : *table) {
      value.entries.push_back({std::string(key.str()), place_of(key.source()), {}});
      convert(item, value.entries.back().value);
    }
  }
}

}  // namespace

const Value* Value::find(std::string_view key) const {
  for (const Entry& entry : entries)
    if (entry.key == key) return &entry.value;
  return nullptr;
}

std::string Value::kind_name() const {
  switch (kind) {
    case Kind::text:
      return "a string";
    case Kind::number:
      return "a number";
    case Kind::flag:
      return flag ? "true" : "false";
    case Kind::list:
      return "a list";
    case Kind::table:
      return "a table";
    case Kind::other:
      break;
  }
  return "a date or time";
}

Value parse_toml(const std::string& text, const std::string& name) {
  refuse_deep_keys(text, name);
  // no file name, because each node would store a counted reference to it
  const toml::parse_result result = toml::parse(text);
  if (result) {
    Value document;
    convert(result.table(), document);
    return document;
  }
  const toml::parse_error& error = result.error();
  refuse(name, place_of(error.source()), plain(std::string(error.description())));
}

}  // namespace redysim
