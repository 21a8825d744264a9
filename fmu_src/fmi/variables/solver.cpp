#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"
#include "integrate/methods/integrator.hpp"

// Settings and statistics of the solver. They have no dependencies and no derivatives.

namespace redysim {
namespace {

template <std::int64_t Statistics::*member>
double read_count(Values& at, const Variable&) {
  return at.integrator() ? static_cast<double>(at.integrator()->statistics().*member) : 0;
}

bool chooses_method(const Scene& scene, const Variable&) {
  return scene.model.solver.method == SolverMethod::automatic;
}

// The numbers are listed in the description of solver.active.
double read_method(Values& at, const Variable&) {
  switch (at.integrator() ? at.integrator()->method() : SolverMethod::automatic) {
    case SolverMethod::erk:
      return 1;
    case SolverMethod::adams:
      return 2;
    case SolverMethod::dirk:
      return 3;
    case SolverMethod::bdf:
      return 4;
    case SolverMethod::exponential:
      return 5;
    case SolverMethod::taylor:
      return 6;
    case SolverMethod::automatic:
      break;
  }
  return 0;
}

template <double SolverSettings::*member>
double& of_solver(Parameters<double>& parameters, const Variable&) {
  return parameters.solver.*member;
}

constexpr Entry health_entries[] = {
    output(Owner::model, "solver.steps")
        .in(OutputGroup::solver)
        .discrete(VariableType::integer)
        .bounds(Bounds::not_negative)
        .reads(read_count<&Statistics::steps>)
        .says("Accepted internal steps"),
    output(Owner::model, "solver.rejected")
        .in(OutputGroup::solver)
        .discrete(VariableType::integer)
        .bounds(Bounds::not_negative)
        .reads(read_count<&Statistics::rejected>)
        .says("Rejected internal steps"),
    output(Owner::model, "solver.rhs_evaluations")
        .in(OutputGroup::solver)
        .discrete(VariableType::integer)
        .bounds(Bounds::not_negative)
        .reads(read_count<&Statistics::evaluations>)
        .says("Evaluations of the equations of motion by the solver"),
    output(Owner::model, "solver.error_estimate")
        .in(OutputGroup::solver)
        .discrete()
        .bounds(Bounds::not_negative)
        .reads([](Values& at, const Variable&) {
          return at.integrator() ? at.integrator()->statistics().error_estimate : 0.0;
        })
        .says("Estimated error of the last internal step relative to the tolerance, with max_rhs "
              "the largest of the communication step"),
    output(Owner::model, "solver.active")
        .in(OutputGroup::solver)
        .there_if(chooses_method)
        .discrete(VariableType::integer)
        .bounds(Bounds::not_negative)
        .reads(read_method)
        .says("Method that auto uses now: 1 erk, 2 adams, 3 dirk, 4 bdf, 5 exponential, "
              "6 taylor, 0 none"),
};

constexpr Entry setting_entries[] = {
    parameter(Owner::model, "solver.method")
        .fixed(VariableType::string)
        .says("Integration method: erk, dirk (explicit, implicit Runge-Kutta), adams, bdf (multistep), "
              "exponential (Rosenbrock), taylor (in a library for the model), auto"),
    parameter(Owner::model, "solver.rtol")
        .fixed()
        .bounds(Bounds::tolerance)
        .sets(of_solver<&SolverSettings::rtol>)
        .says("Relative tolerance of the solver"),
    parameter(Owner::model, "solver.atol")
        .fixed()
        .bounds(Bounds::not_negative)
        .sets(of_solver<&SolverSettings::atol>)
        .says("Absolute tolerance of the solver, in units of each state"),
    parameter(Owner::model, "solver.max_step")
        .fixed()
        .bounds(Bounds::not_negative)
        .sets(of_solver<&SolverSettings::max_step>)
        .measures(quantity::duration)
        .says("Maximum internal step size (0: unlimited)"),
    parameter(Owner::model, "solver.max_rhs")
        .fixed()
        .bounds(Bounds::not_negative)
        .sets(of_solver<&SolverSettings::max_rhs>)
        .says("Maximum number of right-hand sides of a communication step (0: unlimited), with auto and erk"),
};

}  // namespace

const RowGroup SolverHealth::rows = rows_in<health_entries>;
const WordGroup SolverHealth::words = words_in<health_entries>;
const RowGroup SolverParameters::rows = rows_in<setting_entries>;
const WordGroup SolverParameters::words = words_in<setting_entries>;

}  // namespace redysim
