// Pinocchio's forward dynamics with SUNDIALS' solvers, for work_precision.py (see serve.hpp).
//   pinocchio_runner SCENE_TEXT
// Methods: adams and bdf (CVODE, its own interpolation to the output times, no restart), bdf_exact with the
// derivatives of the forward dynamics, erk5 and erk8 (ARKODE), erk8_stop with a stop at each output time.
// Value: rtol; atol is a hundredth of it.

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <cmath>
#include <pinocchio/multibody.hpp>
// require multibody.hpp
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>

#include "scene_text.hpp"
#include "serve.hpp"

namespace {

namespace pin = pinocchio;
using redysim::bench::Run;
using redysim::bench::SceneText;
using State = Eigen::Map<const Eigen::VectorXd>;

class Peer {
 public:
  explicit Peer(const SceneText& scene) : scene_(scene), settings_(1e-14, 1e-14, 1e-10, 20) {
    model_.gravity.linear() = scene.gravity;
    for (const auto& body : scene.bodies) {
      const auto& I = body.inertia;
      Eigen::Matrix3d about_com;
      about_com << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
      const bool turns = body.joint == "revolute";
      const auto joint = model_.addJoint(
          joint_of(body.parent), turns ? pin::JointModel(pin::JointModelRZ()) : pin::JointModelPZ(),
          pin::SE3(body.rotation, body.position), "j" + std::to_string(model_.njoints));
      model_.appendBodyToJoint(joint, pin::Inertia(body.mass, body.com, about_com), pin::SE3::Identity());
      passive_ = passive_ || body.stiffness != 0 || body.damping != 0;
    }
    for (const auto& loop : scene.loops) {
      const auto at = [](const Eigen::Vector3d& point) {
        return pin::SE3(Eigen::Matrix3d::Identity(), point);
      };
      constraints_.emplace_back(pin::CONTACT_3D, model_, joint_of(loop.a), at(loop.point_a), joint_of(loop.b),
                                at(loop.point_b), pin::LOCAL);
      // critically damped; on three scenes ten output steps cost half the time of one at equal error
      const double rate = 0.1 / scene.step;
      constraints_.back().m_baumgarte_parameters.Kp = rate * rate;
      constraints_.back().m_baumgarte_parameters.Kd = 2 * rate;
      constraint_data_.emplace_back(constraints_.back());
    }
    data_ = pin::Data(model_);
    if (!constraints_.empty()) pin::initConstraintDynamics(model_, data_, constraints_, constraint_data_);
    tau_.resize(model_.nv);
    forces_.assign(model_.njoints, pin::Force::Zero());
    choose_convention();
  }

  int size() const { return 2 * model_.nv; }

  void start(double* y) const {
    for (int i = 0; i < model_.nv; ++i) {
      y[i] = scene_.bodies[i].q;
      y[model_.nv + i] = scene_.bodies[i].qd;
    }
  }

  int slope(const double* y, double* ydot) {
    const int n = model_.nv;
    const State q(y, n), qd(y + n, n);
    load(q, qd);
    Eigen::Map<Eigen::VectorXd>(ydot, n) = qd;
    Eigen::Map<Eigen::VectorXd> qdd(ydot + n, n);
    if (!constraints_.empty()) {
      if (!scene_.springs.empty()) {
        pull(q, qd);
        add_forces_to_torques();
      }
      qdd = pin::constraintDynamics(model_, data_, q, qd, tau_, constraints_, constraint_data_, settings_);
    } else if (!scene_.springs.empty()) {
      pull(q, qd);
      qdd = pin::aba(model_, data_, q, qd, tau_, forces_, convention_);
    } else {
      qdd = pin::aba(model_, data_, q, qd, tau_, convention_);
    }
    return qdd.allFinite() ? 0 : 1;
  }

  // Jacobian of the slope of a tree. The rate of a spring is differentiated by velocities only.
  void jacobian(const double* y, Eigen::Ref<Eigen::MatrixXd> J) {
    const int n = model_.nv;
    const State q(y, n), qd(y + n, n);
    load(q, qd);
    if (!scene_.springs.empty()) pull(q, qd);
    pin::computeABADerivatives(model_, data_, q, qd, tau_, forces_);
    const Eigen::MatrixXd inverse = data_.Minv.selfadjointView<Eigen::Upper>();
    J.topLeftCorner(n, n).setZero();
    J.topRightCorner(n, n).setIdentity();
    J.bottomLeftCorner(n, n) = data_.ddq_dq;
    J.bottomRightCorner(n, n) = data_.ddq_dv;
    for (int i = 0; passive_ && i < n; ++i) {
      J.bottomLeftCorner(n, n).col(i) -= scene_.bodies[i].stiffness * inverse.col(i);
      J.bottomRightCorner(n, n).col(i) -= scene_.bodies[i].damping * inverse.col(i);
    }
    if (scene_.springs.empty()) return;
    pin::computeJointJacobians(model_, data_, q);
    for (const auto& spring : scene_.springs) stiffen(spring, inverse, J);
  }

 private:
  static pin::JointIndex joint_of(int body) { return static_cast<pin::JointIndex>(body + 1); }

  // The faster one of a thousand calls each at the start
  void choose_convention() {
    std::vector<double> y(size());
    start(y.data());
    const State q(y.data(), model_.nv), qd(y.data() + model_.nv, model_.nv);
    load(q, qd);
    double seconds[2] = {};
    const pin::Convention conventions[] = {pin::Convention::LOCAL, pin::Convention::WORLD};
    for (int call = 0; call < 20; ++call)
      for (int k = 0; k < 2; ++k) {
        const double begin = redysim::bench::cpu_seconds();
        for (int repeat = 0; repeat < 50; ++repeat) pin::aba(model_, data_, q, qd, tau_, conventions[k]);
        seconds[k] += redysim::bench::cpu_seconds() - begin;
      }
    convention_ = conventions[seconds[1] < seconds[0]];
  }

  void load(const State& q, const State& qd) {
    for (int i = 0; i < model_.nv; ++i) {
      const auto& body = scene_.bodies[i];
      tau_[i] = body.tau;
      if (passive_) tau_[i] -= body.stiffness * (q[i] - body.rest) + body.damping * qd[i];
    }
  }

  struct Tip {
    Eigen::Vector3d position, velocity;
  };

  Tip tip(int body, const Eigen::Vector3d& point) const {
    if (body < 0) return {point, Eigen::Vector3d::Zero()};
    const auto& pose = data_.oMi[joint_of(body)];
    const auto& twist = data_.v[joint_of(body)];
    return {pose.act(point), pose.rotation() * (twist.linear() + twist.angular().cross(point))};
  }

  void push(int body, const Eigen::Vector3d& point, const Eigen::Vector3d& force) {
    if (body < 0) return;
    const Eigen::Vector3d local = data_.oMi[joint_of(body)].rotation().transpose() * force;
    forces_[joint_of(body)] += pin::Force(local, point.cross(local));
  }

  struct Pull {
    Eigen::Vector3d direction;
    double length, force;
  };

  Pull pull_of(const SceneText::Tie& spring) const {
    const Tip a = tip(spring.a, spring.point_a), b = tip(spring.b, spring.point_b);
    const Eigen::Vector3d line = b.position - a.position;
    const double length = line.norm();
    const Eigen::Vector3d direction = line / length;
    const double rate = direction.dot(b.velocity - a.velocity);
    return {direction, length, spring.stiffness * (length - spring.length) + spring.damping * rate};
  }

  void pull(const State& q, const State& qd) {
    pin::forwardKinematics(model_, data_, q, qd);
    for (auto& force : forces_) force.setZero();
    for (const auto& spring : scene_.springs) {
      const Pull pull = pull_of(spring);
      push(spring.a, spring.point_a, pull.force * pull.direction);
      push(spring.b, spring.point_b, -pull.force * pull.direction);
    }
  }

  // constraintDynamics takes no forces on bodies
  void add_forces_to_torques() {
    for (int i = model_.nv; i > 0; --i) {
      const pin::Force& force = forces_[i];
      tau_[i - 1] += scene_.bodies[i - 1].joint == "revolute" ? force.angular()[2] : force.linear()[2];
      forces_[model_.parents[i]] += data_.liMi[i].act(force);
    }
  }

  struct PointJacobian {
    Eigen::Matrix3Xd linear, angular;
  };

  PointJacobian jacobian_of(int body, const Eigen::Vector3d& point) const {
    const int n = model_.nv;
    if (body < 0) return {Eigen::Matrix3Xd::Zero(3, n), Eigen::Matrix3Xd::Zero(3, n)};
    Eigen::Matrix<double, 6, Eigen::Dynamic> J = Eigen::MatrixXd::Zero(6, n);
    pin::getJointJacobian(model_, data_, joint_of(body), pin::LOCAL_WORLD_ALIGNED, J);
    const Eigen::Vector3d arm = data_.oMi[joint_of(body)].rotation() * point;
    return {J.topRows(3) - pin::skew(arm) * J.bottomRows(3), J.bottomRows(3)};
  }

  // Adds the derivatives of a spring's force in axes of the bodies, which computeABADerivatives keeps
  // constant
  void stiffen(const SceneText::Tie& spring, const Eigen::MatrixXd& inverse, Eigen::Ref<Eigen::MatrixXd> J) {
    const int n = model_.nv;
    const Pull pull = pull_of(spring);
    const Eigen::Matrix3d along = pull.direction * pull.direction.transpose();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along;
    const Eigen::Matrix3d stiffness = spring.stiffness * along + pull.force / pull.length * across;
    const PointJacobian a = jacobian_of(spring.a, spring.point_a), b = jacobian_of(spring.b, spring.point_b);
    const Eigen::Matrix3Xd stretch = b.linear - a.linear;
    const Eigen::Matrix3d turn = pin::skew((pull.force * pull.direction).eval());
    const Eigen::MatrixXd by_q = a.linear.transpose() * (stiffness * stretch + turn * a.angular) -
                                 b.linear.transpose() * (stiffness * stretch + turn * b.angular);
    J.bottomLeftCorner(n, n) += inverse * by_q;
    J.bottomRightCorner(n, n) -= inverse * (spring.damping * stretch.transpose() * along * stretch);
  }

  SceneText scene_;
  pin::Model model_;
  pin::Data data_;
  pin::ProximalSettings settings_;
  PINOCCHIO_STD_VECTOR_WITH_EIGEN_ALLOCATOR(pin::RigidConstraintModel) constraints_;
  PINOCCHIO_STD_VECTOR_WITH_EIGEN_ALLOCATOR(pin::RigidConstraintData) constraint_data_;
  PINOCCHIO_ALIGNED_STD_VECTOR(pin::Force) forces_;
  Eigen::VectorXd tau_;
  bool passive_ = false;
  pin::Convention convention_ = pin::Convention::LOCAL;
};

int right_hand_side(double, N_Vector y, N_Vector ydot, void* peer) {
  return static_cast<Peer*>(peer)->slope(N_VGetArrayPointer(y), N_VGetArrayPointer(ydot));
}

int jacobian(double, N_Vector y, N_Vector, SUNMatrix matrix, void* peer, N_Vector, N_Vector, N_Vector) {
  const auto n = SM_ROWS_D(matrix);
  static_cast<Peer*>(peer)->jacobian(N_VGetArrayPointer(y),
                                     Eigen::Map<Eigen::MatrixXd>(SM_DATA_D(matrix), n, n));
  return 0;
}

// Computes all rows; `advance` is one call of a solver.
template <class Advance>
Run record(const SceneText& scene, N_Vector y, const Advance& advance) {
  Run run;
  const std::size_t n = scene.bodies.size();
  const double* q = N_VGetArrayPointer(y);
  run.rows.insert(run.rows.end(), q, q + n);
  const double begin = redysim::bench::cpu_seconds();
  for (int row = 1; row <= scene.rows; ++row) {
    double time = 0;
    const int flag = advance(row * scene.step, &time);
    if (flag < 0) {
      run.failure = "SUNDIALS flag " + std::to_string(flag);
      return run;
    }
    run.rows.insert(run.rows.end(), q, q + n);
  }
  run.seconds = redysim::bench::cpu_seconds() - begin;
  return run;
}

void silent(int, const char*, const char*, char*, void*) {}

Run multistep(Peer& peer, const SceneText& scene, SUNContext context, N_Vector y, const std::string& method,
              double rtol) {
  const bool stiff = method != "adams";
  void* cvode = CVodeCreate(stiff ? CV_BDF : CV_ADAMS, context);
  CVodeInit(cvode, right_hand_side, 0, y);
  CVodeSetErrHandlerFn(cvode, silent, nullptr);
  CVodeSStolerances(cvode, rtol, rtol / 100);
  CVodeSetUserData(cvode, &peer);
  CVodeSetMaxNumSteps(cvode, 10000000);
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear = nullptr;
  SUNNonlinearSolver fixed_point = nullptr;
  if (stiff) {
    matrix = SUNDenseMatrix(peer.size(), peer.size(), context);
    linear = SUNLinSol_Dense(y, matrix, context);
    CVodeSetLinearSolver(cvode, linear, matrix);
    if (method == "bdf_exact") CVodeSetJacFn(cvode, jacobian);
  } else {
    fixed_point = SUNNonlinSol_FixedPoint(y, 0, context);
    CVodeSetNonlinearSolver(cvode, fixed_point);
  }
  const Run run =
      record(scene, y, [&](double end, double* time) { return CVode(cvode, end, y, time, CV_NORMAL); });
  CVodeFree(&cvode);
  if (fixed_point) SUNNonlinSolFree(fixed_point);
  if (linear) SUNLinSolFree(linear);
  if (matrix) SUNMatDestroy(matrix);
  return run;
}

Run one_step(Peer& peer, const SceneText& scene, SUNContext context, N_Vector y, const std::string& method,
             double rtol) {
  void* erk = ERKStepCreate(right_hand_side, 0, y, context);
  ERKStepSetErrHandlerFn(erk, silent, nullptr);
  ERKStepSetTableNum(erk, method == "erk5" ? ARKODE_DORMAND_PRINCE_7_4_5 : ARKODE_FEHLBERG_13_7_8);
  ERKStepSStolerances(erk, rtol, rtol / 100);
  ERKStepSetUserData(erk, &peer);
  ERKStepSetMaxNumSteps(erk, 10000000);
  const Run run = record(scene, y, [&](double end, double* time) {
    if (method == "erk8_stop") ERKStepSetStopTime(erk, end);
    return ERKStepEvolve(erk, end, y, time, ARK_NORMAL);
  });
  ERKStepFree(&erk);
  return run;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fputs("usage: pinocchio_runner SCENE_TEXT\n", stderr);
    return 2;
  }
  const SceneText scene(arguments[1]);
  Peer peer(scene);
  SUNContext context = nullptr;
  SUNContext_Create(nullptr, &context);
  N_Vector y = N_VNew_Serial(peer.size(), context);
  redysim::bench::serve(scene.bodies.size(), [&](const std::string& method, double rtol) -> Run {
    peer.start(N_VGetArrayPointer(y));
    return method.rfind("erk", 0) == 0 ? one_step(peer, scene, context, y, method, rtol)
                                       : multistep(peer, scene, context, y, method, rtol);
  });
  N_VDestroy(y);
  SUNContext_Free(&context);
}
