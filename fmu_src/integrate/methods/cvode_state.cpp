#include <cmath>

#include "integrate/methods/cvode.hpp"

// Saved states of CVODE: its last restart and the number of steps since, which restoring repeats.

namespace redysim {

struct Cvode::Saved {
  double time = 0;
  std::vector<double> y;
  unsigned char restart_due = 0, repeated = 0;  // values of Due and bool
  Restart restart;
  std::int64_t rejected_before = 0;
  double ahead_time = 0;
  std::int32_t steps_taken = 0;
  std::vector<StepWork> works;
  Statistics statistics;
};

void Cvode::save(std::vector<unsigned char>& bytes) const {
  ByteWriter writer(bytes);
  put_header(writer, system_, settings_, method_);
  writer.put(time_);
  writer.put(y_.data(), y_.size());
  writer.put(static_cast<unsigned char>(restart_due_));
  writer.put(restart_.time);
  writer.put(restart_.first_step);
  writer.put(restart_.touch);
  writer.put(restart_.repeated);
  writer.put(restart_.y.data(), restart_.y.size());
  writer.put<std::uint64_t>(restart_.inputs.size());
  writer.put(restart_.inputs.data(), restart_.inputs.size());
  writer.put<std::int64_t>(restart_.rejected_before);
  writer.put(ahead_time_);
  writer.put(steps_taken_);
  for (const StepWork& work : works_) work.put(writer);
  put(writer, statistics_);
}

// False: the bytes are not a valid state.
bool Cvode::read(ByteReader& reader, const System& system, Saved& saved) {
  Restart& restart = saved.restart;
  saved.y.resize(static_cast<std::size_t>(system.size()));
  restart.y = saved.y;
  std::uint64_t inputs = 0;
  reader.get(saved.time);
  reader.get(saved.y.data(), saved.y.size());
  reader.get(saved.restart_due);
  reader.get(restart.time);
  reader.get(restart.first_step);
  reader.get(restart.touch);
  reader.get(saved.repeated);
  reader.get(restart.y.data(), restart.y.size());
  reader.get(inputs);
  if (!reader.good() || !system.is_input_size(inputs)) return false;
  restart.inputs.resize(inputs);
  reader.get(restart.inputs.data(), inputs);
  reader.get(saved.rejected_before);
  reader.get(saved.ahead_time);
  reader.get(saved.steps_taken);
  for (StepWork& work : saved.works) work.get(reader);
  get(reader, saved.statistics);
  restart.repeated = saved.repeated != 0;
  restart.rejected_before = saved.rejected_before;
  if (!reader.finished() || !std::isfinite(saved.time) ||
      saved.restart_due > static_cast<unsigned char>(Due::again))
    return false;
  const bool repeatable = saved.steps_taken >= 0 && saved.steps_taken <= steps_between_restarts &&
                          std::isfinite(restart.time) && restart.first_step > 0;
  return saved.restart_due != 0 || repeatable;
}

bool Cvode::restore(const unsigned char* bytes, std::size_t size) {
  ByteReader reader(bytes, size);
  Saved saved;
  saved.works = works_;
  if (!has_header(reader, system_, settings_, method_) || !read(reader, system_, saved)) return false;
  time_ = saved.time;
  y_.swap(saved.y);
  restart_due_ = static_cast<Due>(saved.restart_due);
  restart_ = std::move(saved.restart);
  if (restart_due_ == Due::no) repeat_steps(saved);
  works_.swap(saved.works);
  statistics_ = saved.statistics;
  return true;
}

// Repeats the steps since the restart with the inputs at the restart.
void Cvode::repeat_steps(const Saved& saved) {
  std::vector<double> present_inputs = restart_.inputs;
  system_.swap_inputs(present_inputs);
  reset_cvode();
  int flag = 0;
  while (steps_taken_ < saved.steps_taken && flag >= 0) flag = take_step();
  system_.swap_inputs(present_inputs);
  // other parameters or another machine give another end: then CVODE restarts from the saved state
  if (flag < 0 || ahead_time_ != saved.ahead_time) restart_due_ = Due::again;
}

}  // namespace redysim
