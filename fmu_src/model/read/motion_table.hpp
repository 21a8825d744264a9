#pragma once

#include <string>
#include <vector>

#include "model/trajectory.hpp"

// Interpolation of a tabulated motion by polynomials with continuous acceleration, except at times with two
// rows: there it jumps.

namespace redysim {

struct MotionTable {
  std::vector<double> time, q, qd, qdd;  // qd and qdd may be empty
};

// The error of a table, one sentence; empty if it is valid.
std::string objection(const MotionTable& table);

// Sets the interval, pieces and jumps. q alone: the cubic spline that starts and ends at rest. q and qd:
// quintics through them, whose acceleration at a knot is the mean of the accelerations of the two adjacent
// cubics. q, qd, qdd: quintics through them.
void interpolate(const MotionTable& table, Trajectory& trajectory);

// The quintic in powers of t with these values, velocities and accelerations at t = 0 and t = length.
std::vector<double> quintic(double length, const double (&start)[3], const double (&end)[3]);
std::vector<double> cubic(double length, double q_start, double qd_start, double q_end, double qd_end);

// Columns "time", "<joint>.q" or "q", and those of .qd and .qdd where they exist, of a CSV text with a
// header line; other columns and lines that begin with # are ignored. Returns the error, or an empty string.
std::string read_csv(const std::string& text, const std::string& joint, MotionTable& table);

}  // namespace redysim
