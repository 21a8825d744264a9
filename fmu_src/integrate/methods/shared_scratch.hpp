#pragma once

#include <memory>

#include "integrate/methods/first_step.hpp"
#include "integrate/methods/sundials_objects.hpp"
#include "integrate/system/dense_jacobian.hpp"

namespace redysim {

// Storage that the methods of `auto` share. Only one method runs at a time, and it keeps nothing here between
// its calls.
class SharedScratch {
 public:
  explicit SharedScratch(System& system)
      : first_step(system.size()),
        vectors{sundials::make_vector(system.size(), context), sundials::make_vector(system.size(), context),
                sundials::make_vector(system.size(), context)},
        start(static_cast<std::size_t>(system.size())),
        system_(system) {}

  sundials::Context context;
  sundials::LastMessage message;
  FirstStepScratch first_step;
  sundials::Vector vectors[3];
  std::vector<double> start;  // state at the start of an advance

  // Created at the first call, for the first implicit method.
  DenseJacobian& jacobian() {
    if (!jacobian_) jacobian_ = std::make_unique<DenseJacobian>(system_);
    return *jacobian_;
  }

 private:
  System& system_;
  std::unique_ptr<DenseJacobian> jacobian_;
};

}  // namespace redysim
