#pragma once

// Four numbers processed together. For double they fill one AVX2 register (or two of SSE2), and an operator
// is one instruction. Other scalars are processed one by one.

#include <cstddef>

#if defined(__GNUC__)
#define REDYSIM_INLINE [[gnu::always_inline]] inline
#else
#define REDYSIM_INLINE inline
#endif

namespace redysim {

// Number of Lanes that hold this many numbers.
constexpr std::size_t lanes_for(std::size_t numbers) { return (numbers + 3) / 4; }

template <class Scalar>
struct Lanes {
  Scalar lane[4];

  static Lanes of(const Scalar& a, const Scalar& b, const Scalar& c, const Scalar& d) {
    return {{a, b, c, d}};
  }
  static Lanes all(const Scalar& a) { return {{a, a, a, a}}; }

  const Scalar& operator[](int k) const { return lane[k]; }
  friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return {{a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]}};
  }
  friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return {{a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]}};
  }
  friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return {{a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]}};
  }
  friend Lanes operator*(const Scalar& s, const Lanes& a) {
    return {{s * a[0], s * a[1], s * a[2], s * a[3]}};
  }
  friend Lanes operator-(const Lanes& a) { return {{-a[0], -a[1], -a[2], -a[3]}}; }
};

// Lanes i, j, k, l of a.
template <int i, int j, int k, int l, class Scalar>
Lanes<Scalar> permuted(const Lanes<Scalar>& a) {
  return {{a[i], a[j], a[k], a[l]}};
}

// Lane k of a if keep_k, otherwise zero.
template <bool keep_0, bool keep_1, bool keep_2, bool keep_3, class Scalar>
Lanes<Scalar> kept(const Lanes<Scalar>& a) {
  const Scalar zero(0);
  return {{keep_0 ? a[0] : zero, keep_1 ? a[1] : zero, keep_2 ? a[2] : zero, keep_3 ? a[3] : zero}};
}

// Stores all four lanes at once: loading all four after partial stores would stall.
template <class Scalar>
void assign(Lanes<Scalar>& to, const Lanes<Scalar>& a) {
  to = a;
}

// Returns (a, b, b, a).
template <class Scalar>
Lanes<Scalar> around(const Scalar& a, const Scalar& b) {
  return {{a, b, b, a}};
}

#if defined(__GNUC__)
template <>
struct alignas(32) Lanes<double> {
  using Register [[gnu::vector_size(32)]] = double;
  Register lane;

  REDYSIM_INLINE static Lanes of(double a, double b, double c, double d) { return {Register{a, b, c, d}}; }
  REDYSIM_INLINE static Lanes all(double a) { return {Register{a, a, a, a}}; }

  REDYSIM_INLINE double operator[](int k) const { return lane[k]; }
  REDYSIM_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) { return {a.lane + b.lane}; }
  REDYSIM_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) { return {a.lane - b.lane}; }
  REDYSIM_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) { return {a.lane * b.lane}; }
  REDYSIM_INLINE friend Lanes operator*(double s, const Lanes& a) { return {s * a.lane}; }
  REDYSIM_INLINE friend Lanes operator-(const Lanes& a) { return {-a.lane}; }
};

template <int i, int j, int k, int l>
REDYSIM_INLINE Lanes<double> permuted(const Lanes<double>& a) {
  return {__builtin_shufflevector(a.lane, a.lane, i, j, k, l)};
}

template <bool keep_0, bool keep_1, bool keep_2, bool keep_3>
REDYSIM_INLINE Lanes<double> kept(const Lanes<double>& a) {
  return {__builtin_shufflevector(a.lane, Lanes<double>::Register{}, keep_0 ? 0 : 4, keep_1 ? 1 : 5,
                                  keep_2 ? 2 : 6, keep_3 ? 3 : 7)};
}

REDYSIM_INLINE void assign(Lanes<double>& to, const Lanes<double>& a) { to.lane = a.lane; }

REDYSIM_INLINE Lanes<double> around(const double& a, const double& b) {
  return {__builtin_shufflevector(Lanes<double>::all(a).lane, Lanes<double>::all(b).lane, 0, 5, 6, 3)};
}
#endif

template <class Scalar>
REDYSIM_INLINE Lanes<Scalar>& operator+=(Lanes<Scalar>& a, const Lanes<Scalar>& b) {
  return a = a + b;
}

template <class Scalar>
REDYSIM_INLINE Lanes<Scalar>& operator-=(Lanes<Scalar>& a, const Lanes<Scalar>& b) {
  return a = a - b;
}

}  // namespace redysim
