#pragma once

namespace redysim {

inline constexpr double pi = 3.14159265358979323846;
inline constexpr double half_pi = pi / 2;
inline constexpr double degree = pi / 180;  // rad

}  // namespace redysim
