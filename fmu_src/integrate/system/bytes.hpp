#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

// Numbers as raw bytes in this machine's byte order; reading checks every length.

namespace redysim {

// Appends numbers to `bytes`.
class ByteWriter {
 public:
  explicit ByteWriter(std::vector<unsigned char>& bytes) : bytes_(bytes) {}

  template <class Value>
  void put(const Value& value) {
    put(&value, 1);
  }
  template <class Value>
  void put(const Value* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<Value>);
    const auto* first = reinterpret_cast<const unsigned char*>(values);
    bytes_.insert(bytes_.end(), first, first + count * sizeof(Value));
  }
  void put_text(const std::string& text) {
    put(text.size());
    put(text.data(), text.size());
  }

 private:
  std::vector<unsigned char>& bytes_;
};

// Reads numbers in the order of writing. After a failed read, all later reads fail.
class ByteReader {
 public:
  ByteReader(const unsigned char* bytes, std::size_t size) : next_(bytes), left_(bytes ? size : 0) {}

  template <class Value>
  void get(Value& value) {
    get(&value, 1);
  }
  template <class Value>
  void get(Value* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<Value>);
    good_ = good_ && count <= left_ / sizeof(Value);
    if (!good_ || count == 0) return;
    std::memcpy(values, next_, count * sizeof(Value));
    next_ += count * sizeof(Value);
    left_ -= count * sizeof(Value);
  }
  const unsigned char* rest() const { return next_; }  // unread bytes
  std::size_t left() const { return left_; }
  bool good() const { return good_; }
  bool finished() const { return good_ && left_ == 0; }  // no failed read and no bytes left

 private:
  const unsigned char* next_;
  std::size_t left_;
  bool good_ = true;
};

}  // namespace redysim
