#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"

// What this library was built for: everything, or what one scene uses (`build-fmu build --specialise`).
// CMake's REDYSIM_FEATURES names the parts; REDYSIM_WITHOUT_<PART> comes from there. Code of an absent part
// stands behind a condition that is constant, so that the compiler and the linker leave it out.

namespace redysim {
namespace features {

#ifdef REDYSIM_WITHOUT_LOOPS
inline constexpr bool loops = false;
#else
inline constexpr bool loops = true;
#endif
#ifdef REDYSIM_WITHOUT_SPRINGS
inline constexpr bool springs = false;
#else
inline constexpr bool springs = true;
#endif
#ifdef REDYSIM_WITHOUT_PORTS
inline constexpr bool ports = false;  // frames at which forces act
#else
inline constexpr bool ports = true;
#endif
#ifdef REDYSIM_WITHOUT_MOTION
inline constexpr bool motion = false;  // prescribed joints
#else
inline constexpr bool motion = true;
#endif
#ifdef REDYSIM_WITHOUT_SPHERICAL
inline constexpr bool spherical = false;
#else
inline constexpr bool spherical = true;
#endif
#ifdef REDYSIM_WITHOUT_CONTROL
inline constexpr bool control = false;  // trajectories and controllers
#else
inline constexpr bool control = true;
#endif
#ifdef REDYSIM_WITHOUT_ERK
inline constexpr bool erk = false;
#else
inline constexpr bool erk = true;
#endif
#ifdef REDYSIM_WITHOUT_ADAMS
inline constexpr bool adams = false;
#else
inline constexpr bool adams = true;
#endif
#ifdef REDYSIM_WITHOUT_DIRK
inline constexpr bool dirk = false;
#else
inline constexpr bool dirk = true;
#endif
#ifdef REDYSIM_WITHOUT_BDF
inline constexpr bool bdf = false;
#else
inline constexpr bool bdf = true;
#endif
#ifdef REDYSIM_HAS_STRAIGHT_LINE
inline constexpr bool straight_line = true;  // forward dynamics compiled for one scene
#else
inline constexpr bool straight_line = false;
#endif

}  // namespace features

// The parts that a model uses, by the names that REDYSIM_FEATURES takes.
std::vector<std::string> features_of(const Model& model);

// The first part that the model uses and this library lacks; empty: it has all.
std::string missing_feature(const Model& model);

// Whether this library holds a method.
bool has_method(SolverMethod method);

}  // namespace redysim
