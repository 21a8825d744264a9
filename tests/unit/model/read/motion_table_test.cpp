#include "model/read/motion_table.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace redysim {
namespace {

double value(const std::vector<double>& c, double t, int order) {
  double sum = 0;
  for (std::size_t k = c.size(); k-- > static_cast<std::size_t>(order);) {
    double factor = 1;
    for (int i = 0; i < order; ++i) factor *= static_cast<double>(k) - i;
    sum = sum * t + factor * c[k];
  }
  return sum;
}

// Largest jump of a derivative between neighbouring pieces.
double jump(const std::vector<Trajectory::Piece>& pieces, int order) {
  double largest = 0;
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    const double h = pieces[k].knot - pieces[k - 1].knot;
    largest = std::max(largest, std::abs(value(pieces[k - 1].coefficients, h, order) -
                                         value(pieces[k].coefficients, 0, order)));
  }
  return largest;
}

MotionTable sine(int points) {
  MotionTable table;
  for (int k = 0; k < points; ++k) {
    // uneven points
    const double t = 2 * k / (points - 1.0) + 0.2 * std::sin(3.0 * k) / points;
    table.time.push_back(t);
    table.q.push_back(std::sin(t));
    table.qd.push_back(std::cos(t));
    table.qdd.push_back(-std::sin(t));
  }
  return table;
}

// Largest error of a derivative of sin, half way between the points.
double error(const std::vector<Trajectory::Piece>& pieces, int order) {
  double largest = 0;
  for (std::size_t k = 0; k + 1 < pieces.size(); ++k) {
    const double h = 0.5 * (pieces[k + 1].knot - pieces[k].knot), t = pieces[k].knot + h;
    const double exact = order == 0 ? std::sin(t) : order == 1 ? std::cos(t) : -std::sin(t);
    largest = std::max(largest, std::abs(value(pieces[k].coefficients, h, order) - exact));
  }
  return largest;
}

std::vector<Trajectory::Piece> pieces_of(const MotionTable& table) {
  Trajectory trajectory;
  interpolate(table, trajectory);
  return trajectory.pieces;
}

TEST(motion_table, quintic_meets_its_ends) {
  const std::vector<double> c = quintic(0.7, {1, -2, 3}, {-4, 5, -6});
  for (int order = 0; order < 3; ++order) {
    EXPECT_NEAR(value(c, 0, order), (std::vector<double>{1, -2, 3})[order], 1e-12);
    EXPECT_NEAR(value(c, 0.7, order), (std::vector<double>{-4, 5, -6})[order], 1e-11);
  }
}

TEST(motion_table, cubic_meets_its_ends) {
  const std::vector<double> c = cubic(0.7, 1, -2, -4, 5);
  EXPECT_NEAR(value(c, 0.7, 0), -4, 1e-12);
  EXPECT_NEAR(value(c, 0.7, 1), 5, 1e-12);
}

TEST(motion_table, positions_alone_make_a_smooth_spline_at_rest_at_its_ends) {
  MotionTable table;
  table.time = {0, 0.3, 1, 1.2, 2};
  table.q = {1, -1, 0.5, 2, 2};
  const auto pieces = pieces_of(table);
  for (int order = 0; order < 3; ++order) EXPECT_LT(jump(pieces, order), 1e-11) << order;
  for (std::size_t k = 0; k < pieces.size(); ++k) EXPECT_EQ(pieces[k].coefficients[0], table.q[k]);
  EXPECT_EQ(pieces.front().coefficients[1], 0);
  EXPECT_NEAR(value(pieces.back().coefficients, 0.8, 1), 0, 1e-12);
  EXPECT_NEAR(value(pieces.back().coefficients, 0.8, 0), 2, 1e-12);
}

TEST(motion_table, a_spline_of_two_points_is_the_cubic_between_rests) {
  MotionTable table;
  table.time = {1, 3};
  table.q = {0, 4};
  const auto pieces = pieces_of(table);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].coefficients, cubic(2, 0, 0, 4, 0));
}

TEST(motion_table, velocities_are_met_and_the_acceleration_is_continuous) {
  MotionTable table = sine(9);
  table.qdd.clear();
  const auto pieces = pieces_of(table);
  for (int order = 0; order < 3; ++order) EXPECT_LT(jump(pieces, order), 1e-11) << order;
  for (std::size_t k = 0; k < pieces.size(); ++k) EXPECT_EQ(pieces[k].coefficients[1], table.qd[k]);
}

// A rest of 5 s beside motions of 0.3 s and 0.5 rad, and of 1 s and 1 rad.
TEST(motion_table, a_long_rest_stays_one_beside_a_short_motion) {
  const MotionTable table{{0, 1, 6, 6.3, 6.6, 10}, {0, 1, 1, 0.5, 1, 1}, {0, 0, 0, 0, 0, 0}, {}};
  const auto pieces = pieces_of(table);
  for (int order = 0; order < 3; ++order) EXPECT_LT(jump(pieces, order), 1e-10) << order;
  for (int part = 0; part <= 100; ++part) {
    EXPECT_NEAR(value(pieces[1].coefficients, 0.05 * part, 0), 1, 5e-3);
    EXPECT_NEAR(value(pieces[4].coefficients, 0.034 * part, 0), 1, 5e-3);
    EXPECT_NEAR(value(pieces[2].coefficients, 0.003 * part, 0), 0.75, 0.27);
  }
}

TEST(motion_table, equal_intervals_share_the_acceleration_between_them) {
  const MotionTable table{{0, 0.1, 0.2, 0.3}, {0, 1, 3, 2}, {0, 2, -1, 0}, {}};
  const auto pieces = pieces_of(table);
  for (std::size_t k : {1u, 2u}) {
    const double h = 0.1,
                 before = 6 * (table.q[k - 1] - table.q[k]) / (h * h) +
                          (2 * table.qd[k - 1] + 4 * table.qd[k]) / h,
                 after = 6 * (table.q[k + 1] - table.q[k]) / (h * h) -
                         (4 * table.qd[k] + 2 * table.qd[k + 1]) / h;
    EXPECT_NEAR(value(pieces[k].coefficients, 0, 2), 0.5 * (before + after), 1e-9);
  }
}

TEST(motion_table, errors_fall_with_the_order_of_what_is_given) {
  for (bool accelerations : {false, true}) {
    MotionTable coarse = sine(9), fine = sine(17);
    if (!accelerations) {
      coarse.qdd.clear();
      fine.qdd.clear();
    }
    // position errors: of the sixth order with accelerations, of the fourth without
    const double ratio = error(pieces_of(coarse), 0) / error(pieces_of(fine), 0);
    EXPECT_GT(ratio, accelerations ? 40 : 10);
    EXPECT_LT(error(pieces_of(fine), 2), accelerations ? 1e-6 : 1e-2);
  }
}

TEST(motion_table, a_bad_table_is_refused_with_a_sentence) {
  EXPECT_EQ(objection({{0}, {1}, {}, {}}), "a table must have at least 2 rows, got 1");
  EXPECT_EQ(objection({{0, 1}, {1}, {}, {}}), "q must be as long as time, 2 numbers, got 1");
  EXPECT_EQ(objection({{0, -1}, {1, 1}, {}, {}}), "time must increase from row to row, got -1 after 0");
  EXPECT_EQ(objection({{0, 1}, {1, 1}, {}, {1, 1}}), "qdd requires qd");
  EXPECT_EQ(objection({{0, 1}, {1, NAN}, {}, {}}), "q must be finite, got nan");
  EXPECT_EQ(objection({{0, 1}, {1, 1}, {1, 1}, {1, 1}}), "");
}

TEST(motion_table, at_two_rows_each_side_has_its_own_cubics) {
  MotionTable table = sine(9), left = table, right = table;
  for (std::vector<double>* column : {&left.time, &left.q, &left.qd}) column->resize(5);
  for (std::vector<double>* column : {&right.time, &right.q, &right.qd})
    column->erase(column->begin(), column->begin() + 4);
  for (std::vector<double>* column : {&table.time, &table.q, &table.qd})
    column->insert(column->begin() + 4, (*column)[4]);
  for (MotionTable* one : {&table, &left, &right}) one->qdd.clear();
  Trajectory whole;
  interpolate(table, whole);
  EXPECT_EQ(whole.jumps, std::vector<std::size_t>{4});
  EXPECT_EQ(whole.begin, table.time.front());
  EXPECT_EQ(whole.end, table.time.back());
  std::vector<Trajectory::Piece> parts = pieces_of(left);
  for (const Trajectory::Piece& piece : pieces_of(right)) parts.push_back(piece);
  ASSERT_EQ(whole.pieces.size(), parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    EXPECT_EQ(whole.pieces[k].knot, parts[k].knot);
    EXPECT_EQ(whole.pieces[k].coefficients, parts[k].coefficients);
  }
}

TEST(motion_table, two_rows_of_one_time_that_contradict_are_refused) {
  EXPECT_EQ(objection({{0, 1, 1, 2}, {0, 3, 3, 4}, {0, 1, 1, 0}, {}}), "");
  EXPECT_EQ(objection({{0, 1, 1, 2}, {0, 3, 3 + 2e-12, 4}, {0, 1, 1, 0}, {1, 2, 3, 4}}), "");  // rounding
  EXPECT_EQ(objection({{0, 1, 1, 2}, {0, 3, 3.5, 4}, {0, 1, 1, 0}, {}}),
            "two rows at time 1 must have the same q, got 3 and 3.5; only the acceleration may jump");
  EXPECT_EQ(objection({{0, 1, 1, 2}, {0, 3, 3, 4}, {0, 1, -1, 0}, {}}),
            "two rows at time 1 must have the same qd, got 1 and -1; only the acceleration may jump");
  EXPECT_EQ(objection({{0, 1, 1, 2}, {0, 3, 3, 4}, {}, {}}), "two rows at time 1 require qd");
  EXPECT_EQ(objection({{0, 1, 1, 1, 2}, {0, 3, 3, 3, 4}, {0, 1, 1, 1, 0}, {}}),
            "a table must have at most two rows at time 1; the acceleration jumps there");
  EXPECT_EQ(objection({{1, 1, 2}, {3, 3, 4}, {1, 1, 0}, {}}),
            "a table must have one row at time 1, its start; the acceleration may jump there anyway");
  EXPECT_EQ(objection({{0, 1, 1}, {3, 4, 4}, {1, 0, 0}, {}}),
            "a table must have one row at time 1, its end; the acceleration may jump there anyway");
}

TEST(motion_table, csv_takes_the_joints_own_columns_first) {
  MotionTable table;
  EXPECT_EQ(
      read_csv("# made by hand\ntime, q,\"b[1].q\" ,b[1].qd\r\n0,9,1,2\n\n 1 ,9, 3e0,-4\n", "b[1]", table),
      "");
  EXPECT_EQ(table.time, (std::vector<double>{0, 1}));
  EXPECT_EQ(table.q, (std::vector<double>{1, 3}));
  EXPECT_EQ(table.qd, (std::vector<double>{2, -4}));
  EXPECT_TRUE(table.qdd.empty());
  MotionTable plain;
  EXPECT_EQ(read_csv("time,q\n0,9\n1,8", "a", plain), "");
  EXPECT_EQ(plain.q, (std::vector<double>{9, 8}));
}

TEST(motion_table, a_bad_csv_is_refused_with_its_line) {
  MotionTable table;
  EXPECT_EQ(read_csv("t,q\n0,1\n", "a", table), "has no column 'time' in its header");
  EXPECT_EQ(read_csv("time,b.q\n0,1\n", "a", table), "has no column 'a.q' or 'q' in its header");
  EXPECT_EQ(read_csv("time,a.q,b.q,a.q\n0,1,2,3\n", "a", table), "repeats column 'a.q'");
  EXPECT_EQ(read_csv("time,q\n0,1\n1,x\n", "a", table), "has no number in column 'q' of line 3");
  EXPECT_EQ(read_csv("time,q\n0\n", "a", table), "has no number in column 'q' of line 2");
}

}  // namespace
}  // namespace redysim
