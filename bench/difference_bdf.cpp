#include "difference_bdf.hpp"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <stdexcept>

#include "integrate/methods/error_weights.hpp"
#include "integrate/methods/sundials_objects.hpp"

namespace redysim {
namespace {

using namespace sundials;

class DifferenceBdf final : public Integrator {
 public:
  DifferenceBdf(System& system, const SolverSettings& settings)
      : system_(system),
        error_weights_(system, settings.rtol, settings.atol),
        now_(created(N_VNew_Serial(system.size(), context_))),
        matrix_(created(SUNDenseMatrix(system.size(), system.size(), context_))),
        solver_(created(SUNLinSol_Dense(now_.get(), matrix_.get(), context_))) {}
  ~DifferenceBdf() override { CVodeFree(&memory_); }
  DifferenceBdf(const DifferenceBdf&) = delete;
  DifferenceBdf& operator=(const DifferenceBdf&) = delete;

  Outcome start(double time, const double* y) override {
    time_ = time;
    std::copy_n(y, system_.size(), data(now_));
    CVodeFree(&memory_);
    memory_ = created(CVodeCreate(CV_BDF, context_));
    CVodeInit(memory_, &DifferenceBdf::right_hand_side, time, now_.get());
    CVodeSetUserData(memory_, this);
    CVodeWFtolerances(memory_, &DifferenceBdf::weights);
    CVodeSetLinearSolver(memory_, solver_.get(), matrix_.get());
    CVodeSetMaxNumSteps(memory_, 10000000);
    return {};
  }

  void set_state(const double* y) override { std::copy_n(y, system_.size(), data(now_)); }
  Outcome advance(double end, bool inputs_changed) override {
    if (inputs_changed) CVodeReInit(memory_, time_, now_.get());
    const int flag = CVode(memory_, end, now_.get(), &time_, CV_NORMAL);
    long fails = 0, solves = 0;
    CVodeGetNumSteps(memory_, &statistics_.steps);
    CVodeGetNumErrTestFails(memory_, &fails);
    CVodeGetNumNonlinSolvConvFails(memory_, &solves);
    statistics_.rejected = fails + solves;
    return flag < 0 ? Outcome{false, "CVODE stopped with " + std::to_string(flag)} : Outcome{};
  }

  double time() const override { return time_; }
  const double* state() const override { return data(now_); }
  const Statistics& statistics() const override { return statistics_; }
  const char* name() const override { return "bdf with a difference Jacobian"; }
  SolverMethod method() const override { return SolverMethod::bdf; }
  void save(std::vector<unsigned char>&) const override { throw std::logic_error("not saved"); }
  bool restore(const unsigned char*, std::size_t) override { return false; }

 private:
  // of SUNDIALS' own vectors, which its difference Jacobian needs
  static double* data(N_Vector vector) { return NV_DATA_S(vector); }
  static double* data(const Vector& vector) { return data(vector.get()); }

  static int right_hand_side(double time, N_Vector y, N_Vector slope, void* self_pointer) {
    DifferenceBdf& self = *static_cast<DifferenceBdf*>(self_pointer);
    ++self.statistics_.evaluations;
    return static_cast<int>(self.system_.right_hand_side(time, data(y), data(slope)));
  }
  static int weights(N_Vector y, N_Vector weights, void* self) {
    static_cast<DifferenceBdf*>(self)->error_weights_.evaluate(data(y), data(weights));
    return 0;
  }

  System& system_;
  ErrorWeights error_weights_;
  Context context_;
  Vector now_;
  Matrix matrix_;
  LinearSolver solver_;
  void* memory_ = nullptr;
  double time_ = 0;
  Statistics statistics_;
};

}  // namespace

std::unique_ptr<Integrator> make_difference_bdf(System& system, const SolverSettings& settings) {
  return std::make_unique<DifferenceBdf>(system, settings);
}

}  // namespace redysim
