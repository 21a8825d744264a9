#pragma once

#include <string>
#include <vector>

#include "model/trajectory.hpp"

// Interpolation of a tabulated motion by polynomials with continuous acceleration. The acceleration jumps
// where the table has two rows with the same time.

namespace redysim {

struct MotionTable {
  std::vector<double> time, q, qd, qdd;  // qd and qdd may be empty
};

// Error of a table, one sentence; empty if it is valid.
std::string objection(const MotionTable& table);

// Sets the interval, the pieces and the jumps of the trajectory. Table with q: cubic spline with zero
// velocity at both ends. With q and qd: quintics whose acceleration at a knot is the weighted mean of the
// accelerations of the two adjacent cubics. With q, qd and qdd: quintics through all values.
void interpolate(const MotionTable& table, Trajectory& trajectory);

// Coefficients in powers of t of the quintic with these values {q, qd, qdd} at t = 0 and t = length.
std::vector<double> quintic(double length, const double (&start)[3], const double (&end)[3]);
std::vector<double> cubic(double length, double q_start, double qd_start, double q_end, double qd_end);

// Reads the columns "time", "<joint>.q" or "q", and those of qd and qdd if they exist, from CSV text with a
// header line. Other columns and lines that begin with # are ignored. Returns the error, or an empty string.
std::string read_csv(const std::string& text, const std::string& joint, MotionTable& table);

}  // namespace redysim
