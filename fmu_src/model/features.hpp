#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

// Features that this library contains: all, or those that one model uses (`build-fmu build --specialise`).
// CMake sets them in REDYSIM_FEATURES. Code of an omitted feature is under a constant condition, so that the
// compiler and the linker remove it.

namespace redysim {
namespace features {

#ifndef REDYSIM_FEATURES
#define REDYSIM_FEATURES "all"
#endif

// Whether REDYSIM_FEATURES lists this feature. Format: "all", or names each followed by a comma.
constexpr bool names(std::string_view part) {
  std::string_view parts = REDYSIM_FEATURES;
  for (std::size_t comma = parts.find(','); comma != parts.npos; comma = parts.find(',')) {
    if (parts.substr(0, comma) == part) return true;
    parts.remove_prefix(comma + 1);
  }
  return false;
}
constexpr bool holds(std::string_view part) {
  return std::string_view(REDYSIM_FEATURES) == "all" || names(part);
}

inline constexpr bool loops = holds("loops");
inline constexpr bool springs = holds("springs");
inline constexpr bool bushings = holds("bushings");
inline constexpr bool contact = holds("contact");
inline constexpr bool friction = holds("friction");  // dry friction and stops in joints
inline constexpr bool ports = holds("ports");        // frames with force inputs
inline constexpr bool motion = holds("motion");      // prescribed joints
inline constexpr bool spherical = holds("spherical");
inline constexpr bool control = holds("control");  // trajectories and controllers
inline constexpr bool actuators = holds("actuators");
inline constexpr bool energies = holds("energies");  // outputs energy.* and the work integral
inline constexpr bool erk = holds("erk");
inline constexpr bool adams = holds("adams");
inline constexpr bool dirk = holds("dirk");
inline constexpr bool bdf = holds("bdf");
inline constexpr bool exponential = holds("exponential");
inline constexpr bool taylor = names("taylor");  // only with straight_line
#ifdef REDYSIM_HAS_STRAIGHT_LINE
inline constexpr bool straight_line = true;  // forward dynamics compiled for one scene
#else
inline constexpr bool straight_line = false;
#endif

}  // namespace features

// Whether a joint has friction or stops, or whether their parameters are tunable.
bool may_resist(const Model& model);

// Whether a library specialised for this model contains Taylor series. It does for method `taylor`, and for
// `auto` in a smooth open tree with few joints.
bool uses_series(const Model& model);

// Names in REDYSIM_FEATURES of the features that a model uses.
std::vector<std::string> features_of(const Model& model);

// The first feature that the model uses and this library omits; empty if there is none.
std::string missing_feature(const Model& model);

// Reason why this library cannot use a method, one sentence; empty if it can.
std::string objection_to_method(SolverMethod method);

}  // namespace redysim
