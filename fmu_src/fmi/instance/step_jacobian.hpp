#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fmi/instance/parameter_set.hpp"
#include "fmi/variables/state_place.hpp"
#include "integrate/methods/transition.hpp"
#include "integrate/system/tangent.hpp"

namespace redysim {

// Derivatives of the state at the end of the last communication step by the state at its start, by force
// inputs held in the step, and by tunable parameters. Coordinates are tangential: positions and velocities of
// the tree (for spherical joints rotation vectors and angular velocities in link axes), then actuator states.
// Rows and columns of prescribed joints are 0. They are computed when read, by a separate System with the
// parameters of that step: the run does not depend on them.
class StepJacobian {
 public:
  enum Part { state, inputs, parameters };

  explicit StepJacobian(Simulation& simulation);
  static bool needed(const Model& model) {
    return model.fmu.shows(OutputGroup::step_jacobian) || model.fmu.shows(OutputGroup::parameter_jacobian);
  }

  void begin_step(const ParameterSet& given);
  void end_step(bool ok);
  void forget();  // there is no last step: its derivative is the identity
  // `with_knowns`: including the derivatives by inputs and parameters.
  bool is_current(bool with_knowns) const {
    return current_ >= (with_knowns ? Current::all : Current::by_state);
  }
  std::string update(bool with_knowns);  // returns the reason of a failure, empty on success
  double entry(Part part, int element) const;

  // Data of the last step, which determine the values, for saved states.
  const std::vector<double>& saved() const { return step_; }
  bool fits(const std::vector<double>& step) const;
  void restore(const std::vector<double>& step);

 private:
  int coordinates() const { return 2 * velocities_ + system_.layout().actuators(); }
  std::size_t size() const { return static_cast<std::size_t>(system_.size()); }
  // Indices in step_.
  std::size_t first_parameter() const { return 2 + 2 * size(); }
  std::size_t first_input() const { return first_parameter() + parameter_count_; }
  void set_parameters();
  void lift(double time, const double* y, double* column, int coordinate);
  const std::vector<Dual>& row_rates(double time, const double* y, const double* column);
  double lower(const double* y, const double* column, int coordinate) const;
  Status by_knowns(double time, const double* y, const DenseJacobian& jacobian, double* columns);
  bool by_known(const Variable& known, double time, const double* y, double* column);
  Transition& transition(std::size_t knowns);
  std::string go_to_start(double* y);
  std::string integrate(Transition& transition, double* y);

  Simulation& simulation_;
  Parameters<double> parameters_;  // of the step
  Plan<double> plan_;
  System system_;
  std::unique_ptr<Transition> transitions_[2];  // without and with knowns; null before the first use
  std::unique_ptr<Tangent> tangent_;
  bool has_parameters_ = false;  // tangent_ has the step's parameters, as constants
  std::vector<CoordinatePlace> coordinates_;
  int velocities_ = 0;
  std::vector<const Variable*> knowns_;  // force inputs, then parameters
  int inputs_ = 0;
  std::size_t parameter_count_ = 0;
  std::vector<double> step_;  // start time, end time, states at both, parameters, inputs; empty: no step
  std::vector<double> columns_, values_;  // values_: coordinates() x (coordinates() + knowns), column-major
  enum class Current { none, by_state, all } current_ = Current::none;
};

}  // namespace redysim
