#include "fmi/boundary/call_table.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace redysim {
namespace {

const std::vector<State> all_states = {State::instantiated, State::initialization, State::step,
                                       State::failed,       State::terminated,     State::event,
                                       State::continuous};

std::vector<State> states_of(Function function) {
  std::vector<State> allowed;
  for (State state : all_states)
    if (is_allowed(function, state)) allowed.push_back(state);
  return allowed;
}

// FMI 2.0.4, section 4.2.4
TEST(CallTable, life_goes_one_way) {
  using States = std::vector<State>;
  EXPECT_EQ(states_of(Function::setup_experiment), States{State::instantiated});
  EXPECT_EQ(states_of(Function::enter_initialization_mode), States{State::instantiated});
  EXPECT_EQ(states_of(Function::exit_initialization_mode), States{State::initialization});
  EXPECT_EQ(states_of(Function::do_step), States{State::step});
  EXPECT_EQ(states_of(Function::terminate),
            (States{State::step, State::failed, State::event, State::continuous}));
  EXPECT_EQ(states_of(Function::reset), all_states);
}

// FMI 2.0.4, section 3.2.3
TEST(CallTable, states_change_in_continuous_time_only) {
  using States = std::vector<State>;
  EXPECT_EQ(states_of(Function::set_continuous_states), States{State::continuous});
  EXPECT_EQ(states_of(Function::completed_integrator_step), States{State::continuous});
  EXPECT_EQ(states_of(Function::new_discrete_states), States{State::event});
  EXPECT_EQ(states_of(Function::set_time), (States{State::event, State::continuous}));
  EXPECT_FALSE(is_allowed(Function::set_string, State::continuous));
}

TEST(CallTable, nothing_is_set_after_the_end) {
  for (Function function : {Function::set_real, Function::set_integer, Function::set_boolean,
                            Function::set_string, Function::set_real_input_derivatives})
    for (State state : {State::failed, State::terminated}) EXPECT_FALSE(is_allowed(function, state));
}

TEST(CallTable, last_values_stay_readable) {
  for (Function function :
       {Function::get_real, Function::get_integer, Function::get_boolean, Function::get_string})
    EXPECT_EQ(states_of(function), all_states) << name(function);
}

TEST(CallTable, no_step_runs_in_the_background) {
  EXPECT_TRUE(states_of(Function::cancel_step).empty());
  EXPECT_EQ(name(Function::cancel_step), "fmi2CancelStep");
}

TEST(CallTable, functions_of_the_other_interface_are_refused) {
  const auto refused = [](Function function) {
    return std::pair(objection_to_kind(function, false) != nullptr,
                     objection_to_kind(function, true) != nullptr);
  };
  using Refused = std::pair<bool, bool>;  // in co-simulation, in model exchange
  for (Function function :
       {Function::enter_event_mode, Function::set_time, Function::get_continuous_states,
        Function::get_derivatives, Function::get_nominals, Function::get_number_of_event_indicators})
    EXPECT_EQ(refused(function), Refused(true, false)) << name(function);
  for (Function function : {Function::set_real_input_derivatives, Function::get_real_output_derivatives,
                            Function::do_step, Function::get_string_status})
    EXPECT_EQ(refused(function), Refused(false, true)) << name(function);
  for (Function function : {Function::set_debug_logging, Function::get_real, Function::get_fmu_state,
                            Function::get_adjoint_derivative})
    EXPECT_EQ(refused(function), Refused(false, false)) << name(function);
}

TEST(CallTable, names_are_those_of_the_version) {
  const auto fmi3 = [](Function function) { return name(function, FmiVersion::three); };
  EXPECT_EQ(fmi3(Function::do_step), "fmi3DoStep");
  EXPECT_EQ(fmi3(Function::get_real), "fmi3GetFloat64");
  EXPECT_EQ(fmi3(Function::deserialize_fmu_state), "fmi3DeserializeFMUState");
}

}  // namespace
}  // namespace redysim
