#pragma once

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

// The time-critical recursions for double, compiled once for any x86-64 processor and once for processors
// with AVX2 and FMA (about twice as fast). Other platforms have one version.

namespace redysim {

// forward_dynamics of dynamics/aba.hpp.
void compiled_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                               const double* qd, const double* inputs, double* qdd);

// inverse_dynamics of dynamics/rnea.hpp.
void compiled_inverse_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                               const double* qd, const double* qdd, double* tau);

// compiled_forward_dynamics without AVX2, for any processor.
void plain_forward_dynamics(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                            const double* qd, const double* inputs, double* qdd);

// set_positions of dynamics/bias.hpp and set_ground_motion of dynamics/ground_motion.hpp, one version for all
// processors.
void compiled_ground_motion(const Plan<double>& plan, Workspace<double>& ws, const double* q,
                            const double* qd);

// prescribed_force of dynamics/joint_elimination.hpp, one version for all processors.
double compiled_prescribed_force(const Plan<double>& plan, const Workspace<double>& ws, int i,
                                 const double* q, const double* qd, const double* qdd);

}  // namespace redysim
