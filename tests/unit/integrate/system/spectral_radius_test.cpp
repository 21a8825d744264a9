#include "integrate/system/spectral_radius.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "integrate/system/stiffest_joint.hpp"
#include "model/read/model_file.hpp"

namespace redysim {
namespace {

// A block of 1 kg that sticks, with friction and friction velocity proportional to its size in m: at rest the
// slope of the friction force is 4 friction / friction_velocity.
TEST(SpectralRadius, stiff_friction_has_the_same_rate_at_any_size) {
  constexpr double rate = 4e7;  // 1/s
  for (const double size : {1.0, 1e-3, 1e-6, 1e-9, 1e-12}) {
    const auto scaled = [size](double value) {
      return std::to_string(value) + "e" + std::to_string(std::lround(std::log10(size)));
    };
    const Model model =
        read_model_text("name = 'block'\n[[link]]\nname = 'block'\njoint = 'prismatic'\nmass = 1\ncom = [" +
                            scaled(0.1) + ", 0, 0]\nfriction = " + scaled(1e4) +
                            "\nfriction_velocity = " + scaled(1e-3) + "\n",
                        "block.toml")
            .model;
    const Plan<double> plan(model);
    System system(plan, false, &model);
    const double at_rest[] = {0, 0};
    EXPECT_NEAR(SpectralRadius(system).estimate(system, 0, at_rest), rate, 0.02 * rate) << size;
    EXPECT_NEAR(find_stiffest_joint(system, 0, at_rest), rate, 0.02 * rate) << size;
  }
}

// A stop and its onset, which a step of 1e-7 rad would pass.
TEST(SpectralRadius, onset_of_a_stop_is_resolved) {
  const Model model = read_model_text(
                          "name = 'rod'\ngravity = [0, 0, 0]\n[[link]]\nname = 'rod'\ninertia = [1, 1, 1]\n"
                          "upper = 1\nlower = -1\nstop_stiffness = 1e12\nstop_width = 1e-8\n",
                          "rod.toml")
                          .model;
  const Plan<double> plan(model);
  System system(plan, false, &model);
  const auto rate = [&system](double depth) {
    const double y[] = {1 + depth, 0};
    return find_stiffest_joint(system, 0, y);
  };
  // full stiffness below the onset, half of it at half depth
  EXPECT_NEAR(rate(2e-8), 1e6, 1e4);
  EXPECT_NEAR(rate(0.5e-8), std::sqrt(0.5) * 1e6, 2e4);
}

// Current and speed of a motor exchange energy at k / sqrt(L J), faster than R / L.
TEST(SpectralRadius, electromechanical_oscillation_is_found) {
  for (const bool geared : {false, true}) {
    const Model model =
        read_model_text(
            "name = 'rod'\n[[link]]\nname = 'rod'\ninertia = [1, 1, 2]\n[[actuator]]\njoint = "
            "'rod'\nresistance = 1\ntorque_constant = 1e3\ninductance = 1e-3\n" +
                std::string(geared ? "rotor_inertia = 2\nstiffness = 10\n" : ""),
            "rod.toml")
            .model;
    const Plan<double> plan(model);
    System system(plan, false, &model);
    const std::vector<double> at_rest(static_cast<std::size_t>(system.size()));
    const double rate = 1e3 / std::sqrt(1e-3 * 2);
    EXPECT_NEAR(find_stiffest_joint(system, 0, at_rest.data()), rate, 1e-3 * rate) << geared;
  }
}

}  // namespace
}  // namespace redysim
