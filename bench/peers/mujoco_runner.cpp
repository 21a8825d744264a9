// MuJoCo through its C interface, for work_precision.py (see serve.hpp).
//   mujoco_runner MODEL.xml ROWS STEP TORQUE...
// Methods: the integrators Euler, RK4, implicit, implicitfast. Value: number of steps per output
// step. `METHOD~` changes the sign of the torques after each step.

#include <mujoco/mujoco.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "serve.hpp"

int main(int count, char** arguments) {
  using redysim::bench::Run;
  if (count < 4) {
    std::fputs("usage: mujoco_runner MODEL.xml ROWS STEP TORQUE...\n", stderr);
    return 2;
  }
  char error[1000] = "";
  mjModel* model = mj_loadXML(arguments[1], nullptr, error, sizeof error);
  if (!model) {
    std::fprintf(stderr, "%s\n", error);
    return 1;
  }
  const int rows = std::atoi(arguments[2]);
  const double step = std::atof(arguments[3]);
  mjData* data = mj_makeData(model);
  // bad states are handled here: no log file
  mju_user_warning = [](const char*) {};
  redysim::bench::serve(static_cast<std::size_t>(model->nq), [&](const std::string& request, double cuts) {
    Run run;
    const bool switching = request.back() == '~';
    const std::string method = request.substr(0, request.size() - switching);
    const char* names[] = {"Euler", "RK4", "implicit", "implicitfast"};
    const int kinds[] = {mjINT_EULER, mjINT_RK4, mjINT_IMPLICIT, mjINT_IMPLICITFAST};
    for (int i = 0; i < 4; ++i)
      if (method == names[i]) model->opt.integrator = kinds[i];
    model->opt.timestep = step / cuts;
    if (model->nkey > 0)
      mj_resetDataKeyframe(model, data, 0);
    else
      mj_resetData(model, data);
    for (int i = 4; i < count; ++i) data->qfrc_applied[i - 4] = std::atof(arguments[i]);
    run.rows.insert(run.rows.end(), data->qpos, data->qpos + model->nq);
    const double begin = redysim::bench::cpu_seconds();
    for (int row = 0; row < rows; ++row) {
      for (int cut = 0; cut < static_cast<int>(cuts); ++cut) {
        mj_step(model, data);
        if (switching)
          for (int i = 0; i < model->nv; ++i) data->qfrc_applied[i] = -data->qfrc_applied[i];
      }
      run.rows.insert(run.rows.end(), data->qpos, data->qpos + model->nq);
      if (data->warning[mjWARN_BADQPOS].number || data->warning[mjWARN_BADQVEL].number ||
          data->warning[mjWARN_BADQACC].number) {
        run.failure = "unstable at t = " + std::to_string(row * step) + " s";
        return run;
      }
    }
    run.seconds = redysim::bench::cpu_seconds() - begin;
    return run;
  });
  mj_deleteData(data);
  mj_deleteModel(model);
}
