#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace redysim {

// A joint's motion as a function of time, in s and rad or m. Before `begin` and after `end` it continues at
// constant velocity.
struct Trajectory {
  // q = from + (to - from) (s - sin(2 pi s) / (2 pi)), s = (t - begin) / (end - begin); or consecutive
  // polynomials, each in powers of the time since its own knot.
  enum class Kind { cycloid, polynomials };
  struct Piece {
    double knot = 0;  // s
    std::vector<double> coefficients;
  };

  Kind kind = Kind::polynomials;
  int link = 0;  // whose joint it moves
  double begin = -std::numeric_limits<double>::infinity();
  double end = std::numeric_limits<double>::infinity();
  double from = 0, to = 0;    // of a cycloid
  std::vector<Piece> pieces;  // with increasing knots
  // Indices of the pieces, without the first, at whose knot the acceleration jumps; increasing.
  std::vector<std::size_t> jumps;
};

}  // namespace redysim
