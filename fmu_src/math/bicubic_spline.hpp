#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "math/cubic_spline.hpp"
#include "math/dual.hpp"

namespace redysim {

// Interpolating bicubic spline z(x, y) with continuous second derivatives over a square grid. Node (row,
// column) is at y = row * spacing, x = column * spacing. Slopes across the border are zero; outside the grid,
// z is constant along the normal of the border.
class BicubicSpline {
 public:
  BicubicSpline() = default;

  // `heights`: rows * columns numbers in m, row-major; at least two rows and two columns.
  BicubicSpline(int rows, int columns, double spacing, std::vector<double> heights)
      : rows_(rows), columns_(columns), spacing_(spacing), nodes_(heights.size()) {
    for (std::size_t k = 0; k < heights.size(); ++k) nodes_[k].z = heights[k];
    for (int row = 0; row < rows; ++row) set_slopes(row * columns, 1, columns, &Node::z, &Node::zx);
    for (int column = 0; column < columns; ++column) {
      set_slopes(column, columns, rows, &Node::z, &Node::zy);
      set_slopes(column, columns, rows, &Node::zx, &Node::zxy);
    }
    highest_ = nodes_.empty() ? 0 : nodes_[0].z;
    for (const Node& node : nodes_) highest_ = std::max(highest_, highest_control_point(node));
  }

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  double spacing() const { return spacing_; }
  double height(int row, int column) const { return nodes_[row * columns_ + column].z; }
  double highest() const { return highest_; }  // an upper bound of z

  template <class Scalar>
  struct Value {
    Scalar z, zx, zy, zxx, zxy, zyy;
  };

  template <class Scalar>
  [[gnu::cold]] Value<Scalar> at(const Scalar& x, const Scalar& y) const {
    const Basis<Scalar> bx = basis(x, columns_), by = basis(y, rows_);
    Value<Scalar> sum{Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0), Scalar(0)};
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        const Node& node = nodes_[(by.cell + i) * columns_ + bx.cell + j];
        const auto add = [&](int dx, int dy, Scalar& to) {
          const Scalar along_x = node.z * by.value[dy][i] + node.zy * by.slope[dy][i];
          const Scalar slope_x = node.zx * by.value[dy][i] + node.zxy * by.slope[dy][i];
          to += bx.value[dx][j] * along_x + bx.slope[dx][j] * slope_x;
        };
        add(0, 0, sum.z);
        add(1, 0, sum.zx);
        add(0, 1, sum.zy);
        add(2, 0, sum.zxx);
        add(1, 1, sum.zxy);
        add(0, 2, sum.zyy);
      }
    return sum;
  }

 private:
  struct Node {
    double z = 0, zx = 0, zy = 0, zxy = 0;
  };

  // Cubic Hermite functions for the values and slopes at both ends of a cell; indices [order of
  // derivative][end].
  template <class Scalar>
  struct Basis {
    int cell = 0;
    Scalar value[3][2], slope[3][2];
  };

  template <class Scalar>
  Basis<Scalar> basis(const Scalar& at, int nodes) const {
    const double last = (nodes - 1) * spacing_, place = std::clamp(value_of(at), 0.0, last);
    const bool inside = value_of(at) > 0 && value_of(at) < last;
    Basis<Scalar> b;
    b.cell = std::min(static_cast<int>(place / spacing_), nodes - 2);
    const double h = spacing_;
    const Scalar u = (inside ? at : Scalar(place)) / Scalar(h) - Scalar(b.cell), w = Scalar(1) - u;
    b.value[0][0] = w * w * (Scalar(1) + Scalar(2) * u);
    b.value[0][1] = u * u * (Scalar(1) + Scalar(2) * w);
    b.slope[0][0] = h * u * w * w;
    b.slope[0][1] = -h * u * u * w;
    b.value[1][1] = Scalar(6 / h) * u * w;
    b.value[1][0] = -b.value[1][1];
    b.slope[1][0] = w * (w - Scalar(2) * u);
    b.slope[1][1] = u * (u - Scalar(2) * w);
    b.value[2][1] = Scalar(6 / (h * h)) * (w - u);
    b.value[2][0] = -b.value[2][1];
    b.slope[2][0] = Scalar(2 / h) * (u - Scalar(2) * w);
    b.slope[2][1] = Scalar(2 / h) * (Scalar(2) * u - w);
    for (int order = 1; order < 3 && !inside; ++order)
      for (int end = 0; end < 2; ++end) b.value[order][end] = b.slope[order][end] = Scalar(0);
    return b;
  }

  void set_slopes(int first, int stride, int count, double Node::*of, double Node::*slope) {
    std::vector<double> x, y;
    for (int k = 0; k < count; ++k) {
      x.push_back(k * spacing_);
      y.push_back(nodes_[first + k * stride].*of);
    }
    const std::vector<double> slopes = spline_slopes(x, y);
    for (int k = 0; k < count; ++k) nodes_[first + k * stride].*slope = slopes[k];
  }

  // Highest Bezier control point near a node. The surface lies in the convex hull of the control points.
  double highest_control_point(const Node& node) const {
    const double third = spacing_ / 3, x = std::abs(node.zx) * third, y = std::abs(node.zy) * third;
    return node.z + x + y + std::abs(node.zxy) * third * third;
  }

  int rows_ = 0, columns_ = 0;
  double spacing_ = 1, highest_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace redysim
