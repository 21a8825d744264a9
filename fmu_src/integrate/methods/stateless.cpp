#include "integrate/methods/methods.hpp"
#include "integrate/methods/state_bytes.hpp"

// All joints are prescribed: there is nothing to integrate, and only the time advances.

namespace redysim {
namespace {

class Stateless final : public Integrator {
 public:
  Outcome start(double time, const double*) override {
    time_ = time;
    return {};
  }
  void set_state(const double*) override {}
  Outcome advance(double end, bool) override {
    if (end != time_ && !is_later(end, time_)) return failure(time_, reasons::end_not_later);
    time_ = end;
    return {};
  }
  double time() const override { return time_; }
  const double* state() const override { return &nothing_; }
  const Statistics& statistics() const override { return statistics_; }
  SolverMethod method() const override { return SolverMethod::automatic; }
  const char* name() const override { return "none: all joints are prescribed"; }

  void save(std::vector<unsigned char>& bytes) const override { ByteWriter(bytes).put(time_); }
  bool restore(const unsigned char* bytes, std::size_t size) override {
    ByteReader reader(bytes, size);
    double time = 0;
    reader.get(time);
    if (!reader.finished() || !std::isfinite(time)) return false;
    time_ = time;
    return true;
  }

 private:
  double time_ = 0;
  double nothing_ = 0;
  Statistics statistics_;
};

}  // namespace

std::unique_ptr<Integrator> make_stateless() { return std::make_unique<Stateless>(); }

}  // namespace redysim
