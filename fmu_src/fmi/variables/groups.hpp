#pragma once

#include <tuple>

#include "fmi/variables/row.hpp"

// Groups of variables; each one is defined in the file of its subject.

namespace redysim {

struct Words;

// The words of a group, in the order of its rows.
struct WordGroup {
  const Words* words;
  int count;
};

struct JointMotionVariables {  // joint.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct BallMotionVariables {  // ball.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct JointDriveVariables {  // joint.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct ActuatorVariables {  // actuator.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct FrameVariables {  // frame.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct LoopVariables {  // loop.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct CouplingVariables {  // coupling.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct ContactVariables {  // contact.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct ContactParameterVariables {  // contact.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct EnergyVariables {  // energy.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct EquationVariables {  // equations.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct JointReactions {  // equations.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct LinkRegressors {  // equations.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct BallReactions {  // equations.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct SolverHealth {  // solver.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct JointStartValues {  // joint.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct BallStartValues {  // ball.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct JointParameterVariables {  // joint_parameters.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct ActuatorParameterVariables {  // actuator.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct LinkParameterVariables {  // link.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct SolverParameters {  // solver.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct StateParameters {  // state.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct IndependentVariables {  // independent.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct StepJacobianVariables {  // step_jacobian.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct JointSlopes {  // joint.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct BallSlopes {  // ball.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct ActuatorStates {  // actuator.cpp
  static const RowGroup rows;
  static const WordGroup words;
};
struct WorkSlopes {  // energy.cpp
  static const RowGroup rows;
  static const WordGroup words;
};

// All groups, in the order of the XML.
using Groups =
    std::tuple<JointMotionVariables, BallMotionVariables, JointDriveVariables, ActuatorVariables,
               FrameVariables, LoopVariables, CouplingVariables, ContactVariables, EnergyVariables,
               EquationVariables, JointReactions, BallReactions, LinkRegressors, SolverHealth,
               JointStartValues, BallStartValues, JointParameterVariables, ActuatorParameterVariables,
               LinkParameterVariables, ContactParameterVariables, SolverParameters, JointSlopes, BallSlopes,
               ActuatorStates, WorkSlopes, IndependentVariables, StepJacobianVariables, StateParameters>;

}  // namespace redysim
