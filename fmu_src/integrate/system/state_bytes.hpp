#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "integrate/methods/integrator.hpp"

// The state of an integrator as bytes in this machine's byte order; every length is checked on reading.

namespace redysim {

class StateWriter {
 public:
  explicit StateWriter(std::vector<unsigned char>& bytes) : bytes_(bytes) { bytes_.clear(); }

  template <class Value>
  void put(const Value& value) {
    put(&value, 1);
  }
  template <class Value>
  void put(const Value* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<Value>);
    const std::size_t before = bytes_.size(), length = count * sizeof(Value);
    bytes_.resize(before + length);
    if (length > 0) std::memcpy(bytes_.data() + before, values, length);
  }

 private:
  std::vector<unsigned char>& bytes_;
};

class StateReader {
 public:
  StateReader(const unsigned char* bytes, std::size_t size) : next_(bytes), left_(bytes ? size : 0) {}

  template <class Value>
  void get(Value& value) {
    get(&value, 1);
  }
  template <class Value>
  void get(Value* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<Value>);
    const std::size_t length = count * sizeof(Value);
    good_ = good_ && length <= left_;
    if (!good_) return;
    std::memcpy(values, next_, length);
    next_ += length;
    left_ -= length;
  }
  const unsigned char* rest() const { return next_; }  // unread bytes
  std::size_t left() const { return left_; }
  bool good() const { return good_; }
  bool finished() const { return good_ && left_ == 0; }  // all read without error

 private:
  const unsigned char* next_;
  std::size_t left_;
  bool good_ = true;
};

// What must agree: format, method, size of the state and tolerances.
struct StateHeader {
  std::uint32_t magic, version, method;
  std::int32_t nq, nv, size;
  double rtol, atol, max_step;
};
StateHeader state_header(const System& system, const SolverSettings& settings, SolverMethod method);
void put(StateWriter& writer, const StateHeader& header);
bool matches(StateReader& reader, const StateHeader& expected);  // reads it

void put(StateWriter& writer, const Statistics& statistics);
void get(StateReader& reader, Statistics& statistics);

}  // namespace redysim
