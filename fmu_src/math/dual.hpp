#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

// Dual numbers a + b eps, eps^2 = 0: one evaluation carries an exact directional derivative. Comparisons
// look at the value alone, so a branch on the model takes the same way as with double.

namespace redysim {

struct Dual {
  double value = 0, derivative = 0;

  Dual() = default;
  Dual(double v) : value(v) {}  // a constant; implicit, as double's own conversions
  Dual(double v, double d) : value(v), derivative(d) {}

  Dual& operator+=(const Dual& o) { return *this = {value + o.value, derivative + o.derivative}; }
  Dual& operator-=(const Dual& o) { return *this = {value - o.value, derivative - o.derivative}; }
  Dual& operator*=(const Dual& o) {
    return *this = {value * o.value, derivative * o.value + value * o.derivative};
  }
  Dual& operator/=(const Dual& o) {
    const double quotient = value / o.value;
    return *this = {quotient, (derivative - quotient * o.derivative) / o.value};
  }
  friend Dual operator+(Dual a, const Dual& b) { return a += b; }
  friend Dual operator-(Dual a, const Dual& b) { return a -= b; }
  friend Dual operator*(Dual a, const Dual& b) { return a *= b; }
  friend Dual operator/(Dual a, const Dual& b) { return a /= b; }
  friend Dual operator-(const Dual& a) { return {-a.value, -a.derivative}; }
  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }
  friend bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend bool operator!=(const Dual& a, const Dual& b) { return a.value != b.value; }
};

inline Dual sin(const Dual& a) { return {std::sin(a.value), std::cos(a.value) * a.derivative}; }
inline Dual cos(const Dual& a) { return {std::cos(a.value), -std::sin(a.value) * a.derivative}; }
inline Dual abs(const Dual& a) { return a.value < 0 ? -a : a; }
inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return {root, a.derivative / (2 * root)};
}
inline Dual tanh(const Dual& a) {
  const double t = std::tanh(a.value);
  return {t, (1 - t * t) * a.derivative};
}
inline Dual exp(const Dual& a) {
  const double e = std::exp(a.value);
  return {e, e * a.derivative};
}

}  // namespace redysim

template <>
struct Eigen::NumTraits<redysim::Dual> : Eigen::NumTraits<double> {
  using Real = redysim::Dual;
  using NonInteger = redysim::Dual;
  using Nested = redysim::Dual;
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
