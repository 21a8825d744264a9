#include "drive/job.hpp"

#include <istream>
#include <sstream>
#include <stdexcept>

namespace redysim::drive {
namespace {

template <class Number>
void read(std::istringstream& line, Number& number) {
  line >> number;
}

// hexadecimal and inf are never needed; a C locale reads the rest exactly
template <class Number>
void read(std::istringstream& line, std::vector<Number>& numbers) {
  for (Number number; line >> number;) numbers.push_back(number);
  if (line.eof()) line.clear();
}

std::string rest(std::istringstream& line) {
  std::string text;
  std::getline(line >> std::ws, text);
  return text;
}

bool take(Job& job, const std::string& word, std::istringstream& line) {
  unsigned reference = 0;
  double number = 0;
  if (word == "mode")
    job.mode = rest(line);
  else if (word == "library")
    job.library = rest(line);
  else if (word == "resources")
    job.resources = rest(line);
  else if (word == "guid")
    job.guid = rest(line);
  else if (word == "tolerance")
    read(line, job.tolerance);
  else if (word == "step")
    read(line, job.step);
  else if (word == "steps")
    read(line, job.steps);
  else if (word == "every")
    read(line, job.every);
  else if (word == "hold")
    read(line, job.hold);
  else if (word == "repeats")
    read(line, job.repeats);
  else if (word == "spend")
    read(line, job.spend);
  else if (word == "budget")
    read(line, job.budget);
  else if (word == "patience")
    read(line, job.patience);
  else if (word == "inputs")
    read(line, job.inputs);
  else if (word == "outputs")
    read(line, job.outputs);
  else if (word == "integers")
    read(line, job.integers);
  else if (word == "names")
    read(line, job.names);
  else if (word == "input")
    read(line, job.motion);
  else if (word == "instances")
    read(line, job.instances);
  else if (word == "real" && line >> reference >> number)
    job.reals.emplace_back(reference, number);
  else if (word == "string" && line >> reference)
    job.strings.emplace_back(reference, rest(line));
  else
    return false;
  return !line.fail();
}

}  // namespace

Job read_job(std::istream& stream) {
  Job job;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    std::istringstream line(text);
    std::string word;
    if (!(line >> word)) continue;
    if (!take(job, word, line))
      throw std::runtime_error("line " + std::to_string(number) + " of the job is not understood: " + text);
  }
  if (job.library.empty() || job.guid.empty())
    throw std::runtime_error("the job names no library or no guid");
  if (!(job.step > 0) || job.steps < 1 || job.every < 1 || job.hold < 1)
    throw std::runtime_error("step, steps, every and hold of the job must be positive");
  if (job.inputs.empty() != job.motion.empty() ||
      (!job.inputs.empty() && job.motion.size() % job.inputs.size() != 0))
    throw std::runtime_error("the job's rows of inputs do not fit the number of inputs");
  return job;
}

}  // namespace redysim::drive
