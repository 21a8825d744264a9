#pragma once

#include "dynamics/workspace.hpp"

// Bushings: linear spring-dampers in all six directions between frame a and frame b, along the axes of frame
// a. With the position d of b in a, its rate, the rotation vector phi of b in a and the relative angular
// velocity omega, in axes of a:
//   V = (d . K d + phi . K_r phi) / 2                                                             (1)
//   force on b at its origin: -(K d + C d')                                                       (2)
//   moment on b:              -(grad_phi V, as a moment (math/rotation_vector.hpp), + C_r omega)   (3)
// and the opposite wrench on a at the same point.

namespace redysim {

// Adds the wrenches of the bushings to the bodies, that is, subtracts them from the bias wrenches. Uses
// ws.ground.
template <class Scalar>
[[gnu::noinline]] void add_bushing_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws);

// The same for one bushing.
template <class Scalar>
void add_bushing_wrench(const BushingPlan<Scalar>& bushing, Workspace<Scalar>& ws);

// Potential energy, J. Uses ws.ground.
template <class Scalar>
[[gnu::noinline]] Scalar bushing_energy(const Plan<Scalar>& plan, const Workspace<Scalar>& ws);

// Power of the dampers, W, <= 0. Uses ws.ground.
template <class Scalar>
[[gnu::noinline]] Scalar bushing_loss(const Plan<Scalar>& plan, const Workspace<Scalar>& ws);
template <class Scalar>
Scalar bushing_loss(const BushingPlan<Scalar>& bushing, const Workspace<Scalar>& ws);

}  // namespace redysim
