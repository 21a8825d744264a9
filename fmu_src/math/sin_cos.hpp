#pragma once

#include <cmath>
#include <cstdint>

#include "math/lanes.hpp"

// Sine and cosine of four angles at once.

namespace redysim {

template <class Scalar>
struct SinCos {
  Lanes<Scalar> sine, cosine;
};

template <class Scalar>
SinCos<Scalar> sin_cos_one_by_one(const Lanes<Scalar>& a) {
  using std::cos;
  using std::sin;
  return {Lanes<Scalar>::of(sin(a[0]), sin(a[1]), sin(a[2]), sin(a[3])),
          Lanes<Scalar>::of(cos(a[0]), cos(a[1]), cos(a[2]), cos(a[3]))};
}

template <class Scalar>
SinCos<Scalar> sin_cos(const Lanes<Scalar>& angle) {
  return sin_cos_one_by_one(angle);
}

#if defined(__GNUC__)
// For larger angles the reduction below is not accurate enough. They, infinity and NaN are passed to the
// standard library.
inline constexpr double largest_reduced_angle = 1e5;

// The error is at most one unit in the last place of 1; except near zeros far from the origin, it is also at
// most one unit in the last place of the result. Reduction to |r| <= pi/4 with pi/2 in two parts (Cody and
// Waite 1980), then the minimax polynomials of FreeBSD's msun (Sun Microsystems 1993) with the rounding of r
// in `tail`.
template <>
REDYSIM_INLINE SinCos<double> sin_cos(const Lanes<double>& angle) {
  using Register = Lanes<double>::Register;
  using Bits [[gnu::vector_size(32)]] = std::int64_t;
  const Register x = angle.lane, size = x * x;
  if (!(size[0] + size[1] + size[2] + size[3] < largest_reduced_angle * largest_reduced_angle))
    return sin_cos_one_by_one(angle);

  // x = k pi/2 + r + tail; adding 1.5 * 2^52 rounds to an integer in the low bits
  constexpr double to_integer = 6755399441055744.0, two_over_pi = 6.36619772367581382433e-01;
  constexpr double half_pi_head = 1.57079632673412561417e+00;  // 33 bits: its product with k is exact
  constexpr double half_pi_rest = 6.07710050650619224932e-11;
  const Register shifted = x * two_over_pi + to_integer, k = shifted - to_integer;
  const Register head = x - k * half_pi_head, rest = k * half_pi_rest;
  const Register r = head - rest, tail = (head - r) - rest;

  const Register z = r * r, v = z * r;
  // sin(r + tail) = r + r^3 S(z) + tail (1 - z/2)
  const Register s = 8.33333333332248946124e-03 +
                     z * (-1.98412698298579493134e-04 +
                          z * (2.75573137070700676789e-06 +
                               z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
  const Register sine = r - ((z * (0.5 * tail - v * s) - tail) + v * 1.66666666666666324348e-01);
  // cos(r + tail) = 1 - z/2 + z^2 C(z) - r tail
  const Register c = 4.16666666666666019037e-02 +
                     z * (-1.38888888888741095749e-03 +
                          z * (2.48015872894767294178e-05 +
                               z * (-2.75573143513906633035e-07 +
                                    z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))));
  const Register half = 0.5 * z, one_less = 1.0 - half;
  const Register cosine = one_less + (((1.0 - one_less) - half) + (z * z * c - r * tail));

  // quadrant k mod 4: odd quadrants swap sine and cosine; bit 1 of k (k + 1) is the sign of the sine (cosine)
  const Bits quarter = reinterpret_cast<Bits>(shifted), odd = -(quarter & 1), sign = Bits{} + INT64_MIN;
  const Bits swap = (reinterpret_cast<Bits>(sine) ^ reinterpret_cast<Bits>(cosine)) & odd;
  const Bits sine_signs = (quarter << 62) & sign, cosine_signs = ((quarter + 1) << 62) & sign;
  SinCos<double> result;
  result.sine.lane = reinterpret_cast<Register>(reinterpret_cast<Bits>(sine) ^ swap ^ sine_signs);
  result.cosine.lane = reinterpret_cast<Register>(reinterpret_cast<Bits>(cosine) ^ swap ^ cosine_signs);
  return result;
}
#endif

}  // namespace redysim
