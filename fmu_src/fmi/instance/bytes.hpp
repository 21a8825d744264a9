#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

// Plain values to bytes and back, bounds checked.

namespace redysim {

class ByteWriter {
 public:
  explicit ByteWriter(std::vector<unsigned char>& bytes) : bytes_(bytes) {}

  template <class T>
  void value(const T& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    block(&v, sizeof v);
  }
  void values(const std::vector<double>& v) { block(v.data(), v.size() * sizeof(double)); }
  void text(const std::string& s) {
    value(s.size());
    block(s.data(), s.size());
  }
  void block(const void* data, std::size_t size) {
    const auto* first = static_cast<const unsigned char*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }

 private:
  std::vector<unsigned char>& bytes_;
};

// Every read says whether the bytes were there; after a failed read all others fail too.
class ByteReader {
 public:
  ByteReader(const unsigned char* bytes, std::size_t size) : next_(bytes), left_(size) {}

  template <class T>
  bool value(T& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    return block(&v, sizeof v);
  }
  bool values(std::vector<double>& v) { return block(v.data(), v.size() * sizeof(double)); }
  bool text(std::string& s) {
    std::size_t size = 0;
    if (!value(size) || size > left_) return fail();
    s.assign(reinterpret_cast<const char*>(next_), size);
    return skip(size);
  }
  bool block(void* data, std::size_t size) {
    if (size > left_) return fail();
    if (size > 0) std::memcpy(data, next_, size);
    return skip(size);
  }
  const unsigned char* rest() const { return next_; }
  std::size_t left() const { return left_; }

 private:
  bool skip(std::size_t size) {
    next_ += size;
    left_ -= size;
    return true;
  }
  bool fail() {
    left_ = 0;
    return false;
  }

  const unsigned char* next_;
  std::size_t left_;
};

}  // namespace redysim
