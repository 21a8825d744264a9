#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

// Dual numbers a + b eps, eps^2 = 0: one evaluation gives the value and its exact derivatives in one or more
// directions. The number of directions is a power of two, so that the compiler keeps them in vector
// registers. Comparisons use the value only; branches are therefore the same as with double.

namespace redysim {

template <int directions>
struct DirectionsOf {
  // same alignment as a single number, as std containers require
  typedef double Type __attribute__((vector_size(directions * sizeof(double)), aligned(alignof(double))));
};
template <>
struct DirectionsOf<1> {
  using Type = double;
};

template <int directions>
struct DualNumber {
  using Derivative = typename DirectionsOf<directions>::Type;
  double value;
  Derivative derivative;

  DualNumber() = default;                           // without values, as double
  DualNumber(double v) : value(v), derivative{} {}  // a constant; implicit like conversions to double
  DualNumber(double v, const Derivative& d) : value(v), derivative(d) {}

  [[gnu::always_inline]] DualNumber& operator+=(const DualNumber& o) {
    value += o.value;
    derivative += o.derivative;
    return *this;
  }
  [[gnu::always_inline]] DualNumber& operator-=(const DualNumber& o) {
    value -= o.value;
    derivative -= o.derivative;
    return *this;
  }
  [[gnu::always_inline]] DualNumber& operator*=(const DualNumber& o) {
    return *this = {value * o.value, derivative * o.value + value * o.derivative};
  }
  DualNumber& operator/=(const DualNumber& o) {
    const double quotient = value / o.value, inverse = 1 / o.value;
    return *this = {quotient, (derivative - quotient * o.derivative) * inverse};
  }
  [[gnu::always_inline]] friend DualNumber operator+(DualNumber a, const DualNumber& b) { return a += b; }
  [[gnu::always_inline]] friend DualNumber operator-(DualNumber a, const DualNumber& b) { return a -= b; }
  [[gnu::always_inline]] friend DualNumber operator*(DualNumber a, const DualNumber& b) { return a *= b; }
  friend DualNumber operator/(DualNumber a, const DualNumber& b) { return a /= b; }
  [[gnu::always_inline]] friend DualNumber operator-(const DualNumber& a) {
    return {-a.value, -a.derivative};
  }
  friend bool operator<(const DualNumber& a, const DualNumber& b) { return a.value < b.value; }
  friend bool operator>(const DualNumber& a, const DualNumber& b) { return a.value > b.value; }
  friend bool operator<=(const DualNumber& a, const DualNumber& b) { return a.value <= b.value; }
  friend bool operator>=(const DualNumber& a, const DualNumber& b) { return a.value >= b.value; }
  friend bool operator==(const DualNumber& a, const DualNumber& b) { return a.value == b.value; }
  friend bool operator!=(const DualNumber& a, const DualNumber& b) { return a.value != b.value; }

  friend DualNumber sin(const DualNumber& a) { return {std::sin(a.value), std::cos(a.value) * a.derivative}; }
  friend DualNumber cos(const DualNumber& a) {
    return {std::cos(a.value), -std::sin(a.value) * a.derivative};
  }
  friend DualNumber abs(const DualNumber& a) { return a.value < 0 ? -a : a; }
  friend DualNumber sqrt(const DualNumber& a) {
    const double root = std::sqrt(a.value);
    return {root, a.derivative / (2 * root)};
  }
  friend DualNumber tanh(const DualNumber& a) {
    const double t = std::tanh(a.value);
    return {t, (1 - t * t) * a.derivative};
  }
  friend DualNumber atan(const DualNumber& a) {
    return {std::atan(a.value), a.derivative / (1 + a.value * a.value)};
  }
  friend DualNumber exp(const DualNumber& a) {
    const double e = std::exp(a.value);
    return {e, e * a.derivative};
  }
};

using Dual = DualNumber<1>;

// Whether the value and all derivatives are 0.
template <class Scalar>
bool is_zero(const Scalar& x) {
  return x == Scalar(0);
}
inline bool is_zero(const Dual& x) { return x.value == 0 && x.derivative == 0; }

// The value without derivatives.
inline double value_of(double x) { return x; }
template <int directions>
double value_of(const DualNumber<directions>& x) {
  return x.value;
}

}  // namespace redysim

template <int directions>
struct Eigen::NumTraits<redysim::DualNumber<directions>> : Eigen::NumTraits<double> {
  using Real = redysim::DualNumber<directions>;
  using NonInteger = Real;
  using Nested = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 2,
    AddCost = 2,
    MulCost = 4
  };
};
