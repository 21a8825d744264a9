#pragma once

#include <string>
#include <vector>

#include "model/trajectory.hpp"

// A motion given at points of time, made into polynomials with a continuous acceleration.

namespace redysim {

struct MotionTable {
  std::vector<double> time, q, qd, qdd;  // qd and qdd may be empty
};

// Why a table is none, one sentence; empty if it is one.
std::string objection(const MotionTable& table);

// q alone: the cubic spline that starts and ends at rest. q and qd: quintics through them, whose acceleration
// at a point is the mean of those of the two cubics that meet there. q, qd, qdd: quintics through them.
std::vector<Trajectory::Piece> interpolate(const MotionTable& table);

// The quintic in powers of t with these values, velocities and accelerations at t = 0 and t = length.
std::vector<double> quintic(double length, const double (&start)[3], const double (&end)[3]);
std::vector<double> cubic(double length, double q_start, double qd_start, double q_end, double qd_end);

// Columns "time", "<joint>.q" or "q", and those of .qd and .qdd where they exist, of a CSV text with one line
// of names; other columns and lines that begin with # are passed over. Returns what is wrong, or nothing.
std::string read_csv(const std::string& text, const std::string& joint, MotionTable& table);

}  // namespace redysim
