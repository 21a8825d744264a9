#pragma once

#include <Eigen/Core>
#include <cmath>
#include <stdexcept>

#include "math/tape.hpp"

// A scalar that records its operations on a tape. Running a recursion once gives straight-line code with
// folded constants, without products by 0 and 1 and without common subexpressions. A branch on a recorded
// value throws std::domain_error; branches on constants are evaluated.

namespace redysim {

// A node of a tape, or a constant without a tape.
class Recorded {
 public:
  Recorded() = default;
  Recorded(double constant) : value_(constant) {}  // implicit like conversions to double
  Recorded(Tape& tape, int node) : tape_(&tape), node_(node) {}

  bool is_constant() const { return !tape_; }
  bool is_zero() const { return !tape_ && value_ == 0; }
  int node_on(Tape& tape) const { return tape_ ? node_ : tape.constant(value_); }

  Recorded& operator+=(const Recorded& o) { return *this = *this + o; }
  Recorded& operator-=(const Recorded& o) { return *this = *this - o; }
  Recorded& operator*=(const Recorded& o) { return *this = *this * o; }
  Recorded& operator/=(const Recorded& o) { return *this = *this / o; }
  friend Recorded operator+(const Recorded& a, const Recorded& b) {
    return combine(Tape::Operation::add, a, b, a.value_ + b.value_);
  }
  friend Recorded operator-(const Recorded& a, const Recorded& b) {
    return combine(Tape::Operation::subtract, a, b, a.value_ - b.value_);
  }
  friend Recorded operator*(const Recorded& a, const Recorded& b) {
    return combine(Tape::Operation::multiply, a, b, a.value_ * b.value_);
  }
  friend Recorded operator/(const Recorded& a, const Recorded& b) {
    return combine(Tape::Operation::divide, a, b, a.value_ / b.value_);
  }
  friend Recorded operator-(const Recorded& a) { return Recorded(0) - a; }

  friend bool operator<(const Recorded& a, const Recorded& b) { return a.decided() < b.decided(); }
  friend bool operator>(const Recorded& a, const Recorded& b) { return a.decided() > b.decided(); }
  friend bool operator<=(const Recorded& a, const Recorded& b) { return a.decided() <= b.decided(); }
  friend bool operator>=(const Recorded& a, const Recorded& b) { return a.decided() >= b.decided(); }
  friend bool operator==(const Recorded& a, const Recorded& b) { return a.decided() == b.decided(); }
  friend bool operator!=(const Recorded& a, const Recorded& b) { return a.decided() != b.decided(); }

  friend Recorded sin(const Recorded& a) { return a.called("sin", std::sin(a.value_)); }
  friend Recorded cos(const Recorded& a) { return a.called("cos", std::cos(a.value_)); }
  friend Recorded sqrt(const Recorded& a) { return a.called("sqrt", std::sqrt(a.value_)); }
  friend Recorded abs(const Recorded& a) { return a.called("abs", std::abs(a.value_)); }
  friend Recorded tanh(const Recorded& a) { return a.called("tanh", std::tanh(a.value_)); }
  friend Recorded exp(const Recorded& a) { return a.called("exp", std::exp(a.value_)); }

  friend double value_of(const Recorded& a) { return a.decided(); }

 private:
  double decided() const {
    if (tape_) throw std::domain_error("a branch on the state has no straight line");
    return value_;
  }
  Recorded called(const char* name, double of_constant) const {
    return tape_ ? Recorded(*tape_, tape_->function(name, node_)) : Recorded(of_constant);
  }
  static Recorded combine(Tape::Operation operation, const Recorded& a, const Recorded& b,
                          double of_constants) {
    Tape* tape = a.tape_ ? a.tape_ : b.tape_;
    if (!tape) return of_constants;
    const int node = tape->apply(operation, a.node_on(*tape), b.node_on(*tape));
    // a folded constant has no tape, so that branches on it can be evaluated
    if ((*tape)[node].operation == Tape::Operation::constant) return (*tape)[node].value;
    return {*tape, node};
  }

  Tape* tape_ = nullptr;
  int node_ = -1;
  double value_ = 0;  // used without a tape
};

}  // namespace redysim

template <>
struct Eigen::NumTraits<redysim::Recorded> : Eigen::NumTraits<double> {
  using Real = redysim::Recorded;
  using NonInteger = Real;
  using Nested = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};
