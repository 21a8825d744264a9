#pragma once

#include <string>
#include <string_view>

namespace redysim {

// Writes JSON in the order of the calls; numbers can be read back exactly and do not depend on the locale.
class Json {
 public:
  Json& begin_object() { return open('{'); }
  Json& end_object() { return close('}'); }
  Json& begin_array() { return open('['); }
  Json& end_array() { return close(']'); }
  Json& key(std::string_view name);
  Json& value(std::string_view text);
  Json& value(const char* text) { return value(std::string_view(text)); }
  Json& value(double number);
  Json& value(int number);
  Json& value(unsigned number);
  Json& value(bool flag);
  Json& null();

  template <class Value>
  Json& member(std::string_view name, const Value& v) {
    return key(name).value(v);
  }
  const std::string& text() const { return text_; }

 private:
  Json& open(char bracket);
  Json& close(char bracket);
  Json& raw(std::string_view token);
  void separate();
  void quote(std::string_view text);

  std::string text_;
  bool first_ = true;  // no element yet in this object, array or member
};

}  // namespace redysim
