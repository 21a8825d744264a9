#include "fmi/describe/json.hpp"

#include "model/number.hpp"

namespace redysim {

void Json::separate() {
  if (!first_) text_ += ',';
  first_ = false;
}

Json& Json::open(char bracket) {
  separate();
  text_ += bracket;
  first_ = true;
  return *this;
}

Json& Json::close(char bracket) {
  text_ += bracket;
  first_ = false;
  return *this;
}

Json& Json::raw(std::string_view token) {
  separate();
  text_ += token;
  return *this;
}

void Json::quote(std::string_view text) {
  text_ += '"';
  for (char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      text_ += '\\';
      text_ += c;
    } else if (code < 0x20) {
      constexpr const char* digits = "0123456789abcdef";
      text_ += "\\u00";
      text_ += digits[code >> 4];
      text_ += digits[code & 15];
    } else {
      text_ += c;
    }
  }
  text_ += '"';
}

Json& Json::key(std::string_view name) {
  separate();
  quote(name);
  text_ += ':';
  first_ = true;
  return *this;
}

Json& Json::value(std::string_view text) {
  separate();
  quote(text);
  return *this;
}

Json& Json::value(double number) { return raw(shown(number)); }
Json& Json::value(int number) { return raw(std::to_string(number)); }
Json& Json::value(unsigned number) { return raw(std::to_string(number)); }
Json& Json::value(bool flag) { return raw(flag ? "true" : "false"); }
Json& Json::null() { return raw("null"); }

}  // namespace redysim
