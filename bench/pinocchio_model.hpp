#pragma once

#include <memory>
#include <string>

#include "model/model.hpp"

namespace redysim::bench {

// The open tree of a model in Pinocchio, with its data. Revolute joints only. Pinocchio's headers are
// hidden, so that only one file needs its compile options.
class __attribute__((visibility("default"))) PinocchioTree {
 public:
  explicit PinocchioTree(const Model& model);
  ~PinocchioTree();

  // aba and rnea; `world` selects the convention with spatial quantities in ground axes.
  const double* forward_dynamics(const double* q, const double* qd, const double* tau, bool world);
  const double* inverse_dynamics(const double* q, const double* qd, const double* qdd);

  static std::string version();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace redysim::bench
