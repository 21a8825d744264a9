#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace redysim {

// Motion of a joint as a function of time, in s and rad or m. Before `begin` and after `end` it continues
// with constant velocity.
struct Trajectory {
  // cycloid: q = from + (to - from) (s - sin(2 pi s) / (2 pi)), s = (t - begin) / (end - begin). polynomials:
  // consecutive pieces, each in powers of the time since its own knot.
  enum class Kind { cycloid, polynomials };
  struct Piece {
    double knot = 0;  // s
    std::vector<double> coefficients;
  };

  Kind kind = Kind::polynomials;
  int link = 0;  // the joint of this link
  double begin = -std::numeric_limits<double>::infinity();
  double end = std::numeric_limits<double>::infinity();
  double from = 0, to = 0;    // for a cycloid
  std::vector<Piece> pieces;  // in order of increasing knots
  // Increasing indices of the pieces at whose knot the acceleration jumps; never the first piece.
  std::vector<std::size_t> jumps;
};

}  // namespace redysim
