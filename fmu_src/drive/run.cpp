#include "drive/run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>

#include "drive/computing_time.hpp"

namespace redysim::drive {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

constexpr long fewest_repeats = 3;

struct Record {
  std::string status = "ok", phase;
  double reached = 0;
  long steps_done = 0;
  std::vector<double> times, values;    // rows of outputs
  std::vector<double> seconds;          // of each whole run
  std::vector<std::string> run_status;  // of a batch, per run
  std::vector<std::size_t> run_rows;
  bool bad = false;  // a value was not finite although fmi2OK was returned
  unsigned bad_reference = 0;
  double bad_time = 0;
  double last_successful = -1;
  std::string after;                         // state of the instance after a failure
  std::vector<std::string> integers, texts;  // at the end of the recorded run; empty: could not be read
};

class Run {
 public:
  Run(const FmuLibrary& fmu, const Job& job, Watchdog& watchdog)
      : fmu_(fmu),
        job_(job),
        watchdog_(watchdog),
        row_(job.outputs.size()),
        begin_(Clock::now()),
        computed_(computing_seconds()) {}

  // One run per row of values; a failed run does not end the others.
  void batch(fmi2Component instance) {
    const std::size_t width = job_.vary.size(), count = job_.values.size() / width;
    Job varied = job_;
    for (const fmi2ValueReference reference : job_.vary) varied.reals.emplace_back(reference, 0);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < width; ++j)
        varied.reals[job_.reals.size() + j].second = job_.values[i * width + j];
      first_ = static_cast<long>(i) * job_.steps;
      record.status = "ok";
      const std::size_t rows = record.times.size();
      double seconds = 0;
      if (i > 0 && fmu_.reset(instance) > fmi2Warning)
        fail("error", "reset");
      else if (begin(instance, varied))
        recorded(instance, seconds);
      record.run_status.push_back(record.status);
      record.run_rows.push_back(record.times.size() - rows);
    }
    record.status = "ok";
  }

  void all(fmi2Component instance) {
    double seconds = 0;
    if (!begin(instance, job_)) return;
    const bool whole = recorded(instance, seconds);
    if (record.steps_done > 0) record.seconds.push_back(seconds);
    read_health(instance);
    if (failed_step_) look_after(instance);
    if (!whole) return;
    const double computed = computing_seconds();
    for (long i = 0; i < job_.repeats && !is_late(); ++i) {
      if (i >= fewest_repeats && computing_seconds() - computed > job_.spend) break;
      if (!again(instance)) return;
    }
    // runs without reading outputs and without timing each step are more accurate than the first run
    if (record.seconds.size() > 1) record.seconds.erase(record.seconds.begin());
  }

  Record record;

 private:
  // Reading the CPU clock is slow, so it is checked last. On a stalled machine, wall-clock time ends the
  // wait.
  bool is_late() const {
    const double passed = seconds_since(begin_);
    return passed > job_.budget &&
           (computing_seconds() - computed_ > job_.budget || passed > most_waiting * job_.budget);
  }

  bool fail(const char* status, const char* phase) {
    record.status = status;
    record.phase = phase;
    return false;
  }

  bool begin(fmi2Component instance, const Job& job) {
    watchdog_.at("initialise", 0);
    if (initialise(fmu_, instance, job, first_) > fmi2Warning) return fail("refused", "initialise");
    watchdog_.at("step", 0);
    return true;
  }

  // Records the outputs at a communication point. Ends the run if a value is not finite.
  bool read_row(fmi2Component instance, double time) {
    if (fmu_.get_real(instance, job_.outputs.data(), row_.size(), row_.data()) > fmi2Warning)
      return fail("error", "read");
    record.times.push_back(time);
    record.values.insert(record.values.end(), row_.begin(), row_.end());
    for (std::size_t i = 0; i < row_.size(); ++i)
      if (!std::isfinite(row_[i])) {
        record.bad = true;
        record.bad_reference = job_.outputs[i];
        record.bad_time = time;
        return fail("not finite", "read");
      }
    return true;
  }

  // A run that records outputs. `seconds` includes the time of inputs and steps only.
  bool recorded(fmi2Component instance, double& seconds) {
    if (!read_row(instance, 0)) return false;
    for (long k = 0; k < job_.steps; ++k) {
      const double time = static_cast<double>(k) * job_.step, end = static_cast<double>(k + 1) * job_.step;
      const auto start = Clock::now();
      if (set_inputs(fmu_, instance, job_, first_ + k) > fmi2Warning) return fail("error", "input");
      const fmi2Status status = fmu_.do_step(instance, time, end - time, fmi2True);
      seconds += seconds_since(start);
      watchdog_.at(end);
      if (status != fmi2OK) {
        failed_step_ = true;
        return fail(status == fmi2Error ? "error" : "other status", "step");
      }
      record.reached = end;
      record.steps_done = k + 1;
      const bool late = is_late();
      if (((k + 1) % job_.every == 0 || k + 1 == job_.steps || late) && !read_row(instance, end))
        return false;
      if (late && k + 1 < job_.steps) return fail("budget", "step");
    }
    return true;
  }

  // A further run with inputs and steps only.
  bool again(fmi2Component instance) {
    if (fmu_.reset(instance) > fmi2Warning) return fail("error", "reset");
    if (!begin(instance, job_)) return false;
    const double start = computing_seconds();
    for (long k = 0; k < job_.steps; ++k) {
      const double time = static_cast<double>(k) * job_.step, end = static_cast<double>(k + 1) * job_.step;
      if (set_inputs(fmu_, instance, job_, k) > fmi2Warning ||
          fmu_.do_step(instance, time, end - time, fmi2True) != fmi2OK)
        return fail("error", "repeat");
    }
    record.seconds.push_back(computing_seconds() - start);
    return true;
  }

  void read_health(fmi2Component instance) {
    for (fmi2ValueReference reference : job_.integers) {
      fmi2Integer value = 0;
      const bool read = fmu_.get_integer(instance, &reference, 1, &value) <= fmi2Warning;
      record.integers.push_back(read ? std::to_string(value) : "");
    }
    for (fmi2ValueReference reference : job_.names) {
      fmi2String text = nullptr;
      const bool read = fmu_.get_string(instance, &reference, 1, &text) <= fmi2Warning && text;
      record.texts.push_back(read ? text : "");
    }
  }

  // After a failed step: reads the time reached, checks that outputs are finite, and tries a reset and a new
  // start.
  void look_after(fmi2Component instance) {
    fmi2Real last = -1;
    if (fmu_.get_real_status(instance, fmi2LastSuccessfulTime, &last) == fmi2OK)
      record.last_successful = last;
    const bool reads = fmu_.get_real(instance, job_.outputs.data(), row_.size(), row_.data()) <= fmi2Warning;
    const bool finite =
        !reads || std::all_of(row_.begin(), row_.end(), [](double value) { return std::isfinite(value); });
    if (!finite) record.after = "values that are not finite";
    if (fmu_.reset(instance) > fmi2Warning)
      record.after = "reset refused";
    else if (initialise(fmu_, instance, job_) > fmi2Warning)
      record.after = "no new start after reset";
    if (record.after.empty()) record.after = "usable";
  }

  const FmuLibrary& fmu_;
  const Job& job_;
  Watchdog& watchdog_;
  std::vector<double> row_;
  bool failed_step_ = false;
  long first_ = 0;  // step number at the start, selects the inputs
  Clock::time_point begin_;
  double computed_;
};

void write(const Record& record, const Job& job, Json& json) {
  json.member("status", record.status).member("phase", record.phase).member("reached", record.reached);
  json.member("steps_done", static_cast<double>(record.steps_done));
  std::vector<double> seconds = record.seconds;
  if (!seconds.empty()) {
    std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
    json.member("seconds", seconds[seconds.size() / 2]);
  }
  if (record.bad) json.member("bad_reference", record.bad_reference).member("bad_time", record.bad_time);
  if (!record.after.empty())
    json.member("after", record.after).member("last_successful_time", record.last_successful);
  json.key("times").begin_array();
  for (double time : record.times) json.value(time);
  json.end_array().key("values").begin_array();
  const std::size_t width = job.outputs.size();
  for (std::size_t i = 0; i < record.times.size(); ++i) {
    json.begin_array();
    for (std::size_t j = 0; j < width; ++j) {
      const double value = record.values[i * width + j];
      std::isfinite(value) ? json.value(value) : json.null();
    }
    json.end_array();
  }
  json.end_array().key("run_status").begin_array();
  for (const std::string& status : record.run_status) json.value(std::string_view(status));
  json.end_array().key("run_rows").begin_array();
  for (const std::size_t rows : record.run_rows) json.value(static_cast<double>(rows));
  json.end_array().key("integers").begin_array();
  for (const std::string& value : record.integers) value.empty() ? json.null() : json.value(std::stoi(value));
  json.end_array().key("texts").begin_array();
  for (const std::string& text : record.texts)
    text.empty() ? json.null() : json.value(std::string_view(text));
  json.end_array();
}

}  // namespace

fmi2Status set_inputs(const FmuLibrary& fmu, fmi2Component instance, const Job& job, long index) {
  const std::size_t width = job.inputs.size();
  if (width == 0) return fmi2OK;
  const std::size_t rows = job.motion.size() / width, row = static_cast<std::size_t>(index / job.hold) % rows;
  return fmu.set_real(instance, job.inputs.data(), width, &job.motion[row * width]);
}

fmi2Status initialise(const FmuLibrary& fmu, fmi2Component instance, const Job& job, long first) {
  fmi2Status worst = fmu.setup_experiment(instance, job.tolerance > 0, job.tolerance, 0, fmi2False, 0);
  for (const auto& [reference, text] : job.strings) {
    const char* word = text.c_str();
    worst = std::max(worst, fmu.set_string(instance, &reference, 1, &word));
  }
  for (const auto& [reference, value] : job.reals)
    worst = std::max(worst, fmu.set_real(instance, &reference, 1, &value));
  if (worst > fmi2Warning) return worst;
  worst = std::max(worst, set_inputs(fmu, instance, job, first));
  worst = std::max(worst, fmu.enter_initialization_mode(instance));
  if (worst > fmi2Warning) return worst;
  return std::max(worst, fmu.exit_initialization_mode(instance));
}

void run(const FmuLibrary& fmu, const Job& job, Watchdog& watchdog, Json& json) {
  MessageLog log;
  const fmi2CallbackFunctions callbacks{MessageLog::callback, nullptr, nullptr, nullptr, &log};
  watchdog.at("instantiate", 0);
  fmi2Component instance = fmu.instantiate("driven", fmi2CoSimulation, job.guid.c_str(),
                                           job.resources.c_str(), &callbacks, fmi2False, fmi2False);
  Run work(fmu, job, watchdog);
  if (instance) {
    job.vary.empty() ? work.all(instance) : work.batch(instance);
  } else {
    work.record.status = "refused";
    work.record.phase = "instantiate";
  }
  write(work.record, job, json);
  json.key("log").begin_array();
  for (const std::string& line : log.lines()) json.value(std::string_view(line));
  json.end_array();
  if (instance) fmu.free_instance(instance);
}

int serve_job(const char* program, Answer* answer) {
  try {
    const Job job = read_job(std::cin);
    FmuLibrary fmu;
    Json json;
    json.begin_object();
    {
      Watchdog watchdog(job.budget + job.patience);
      answer(fmu, job, fmu.load(job.library), watchdog, json);
    }
    json.end_object();
    std::printf("%s\n", json.text().c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 2;
  }
}

}  // namespace redysim::drive
