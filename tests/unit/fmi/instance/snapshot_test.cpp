#include "fmi/instance/snapshot.hpp"

#include <gtest/gtest.h>

#include "model/read/model_file.hpp"

namespace redysim {
namespace {

struct Saved {
  Model model = read_model_file(REDYSIM_MODELS "/double_pendulum.toml").model;
  Plan<double> plan{model};
  System system{plan, false, &model};
  Snapshot::Sizes sizes{2, system.scales().size(), 3};
  Bytes bytes;

  Saved() {
    Snapshot snapshot;
    snapshot.life.state = State::step;
    snapshot.life.start_time = 0.25;
    snapshot.time = 1.5;
    snapshot.pending.changed = true;
    snapshot.follows_motion = false;
    snapshot.method = SolverMethod::bdf;
    snapshot.parameters = {3, 4};
    snapshot.inputs = system.inputs();
    snapshot.applied_inputs = system.inputs();
    snapshot.scales = system.scales();
    snapshot.motion = {{5, 6, 7}, {0, 1, 0}};
    snapshot.write(bytes);
  }
  bool read(Snapshot& snapshot) const { return snapshot.read(bytes, sizes, system); }
};

TEST(Snapshot, is_read_as_it_was_written) {
  Saved saved;
  saved.bytes.push_back(42);  // of the integrator
  Snapshot found;
  ASSERT_TRUE(saved.read(found));
  EXPECT_EQ(found.life.state, State::step);
  EXPECT_EQ(found.life.start_time, 0.25);
  EXPECT_EQ(found.time, 1.5);
  EXPECT_TRUE(found.pending.changed);
  EXPECT_FALSE(found.follows_motion);
  EXPECT_EQ(found.method, SolverMethod::bdf);
  EXPECT_EQ(found.parameters, (std::vector<double>{3, 4}));
  EXPECT_EQ(found.motion.values, (std::vector<double>{5, 6, 7}));
  EXPECT_EQ(found.motion.was_set, (std::vector<unsigned char>{0, 1, 0}));
  ASSERT_EQ(found.integrator_size, 1u);
  EXPECT_EQ(found.integrator[0], 42);
}

TEST(Snapshot, truncated_bytes_are_refused_at_every_length) {
  Saved saved;
  while (!saved.bytes.empty()) {
    saved.bytes.pop_back();
    Snapshot found;
    EXPECT_FALSE(saved.read(found)) << saved.bytes.size();
  }
}

TEST(Snapshot, an_unknown_state_or_method_is_refused) {
  // of the state, of whether one is given, of the method
  for (std::size_t place : {std::size_t{0}, 4 + 5 * sizeof(double) + 12, 4 + 5 * sizeof(double) + 20}) {
    Saved saved;
    saved.bytes[place] = 77;
    Snapshot found;
    EXPECT_FALSE(saved.read(found)) << place;
  }
}

}  // namespace
}  // namespace redysim
