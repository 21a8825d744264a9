#include "drive/job.hpp"

#include <algorithm>
#include <istream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <type_traits>

namespace redysim::drive {
namespace {

template <class Number>
void read(std::istringstream& line, Number& number) {
  line >> number;
}

// A C locale reads decimal numbers exactly; hexadecimal numbers and inf do not occur.
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

// A word of a job and the member that takes its values.
struct Word {
  const char* word;
  void (*take)(Job& job, std::istringstream& line);
};

template <auto member>
void to(Job& job, std::istringstream& line) {
  if constexpr (std::is_same_v<decltype(member), std::string Job::*>)
    job.*member = rest(line);
  else
    read(line, job.*member);
}

constexpr Word words[] = {
    {"library", to<&Job::library>},   {"resources", to<&Job::resources>},
    {"guid", to<&Job::guid>},         {"tolerance", to<&Job::tolerance>},
    {"step", to<&Job::step>},         {"steps", to<&Job::steps>},
    {"every", to<&Job::every>},       {"hold", to<&Job::hold>},
    {"repeats", to<&Job::repeats>},   {"spend", to<&Job::spend>},
    {"budget", to<&Job::budget>},     {"patience", to<&Job::patience>},
    {"inputs", to<&Job::inputs>},     {"outputs", to<&Job::outputs>},
    {"integers", to<&Job::integers>}, {"names", to<&Job::names>},
    {"input", to<&Job::motion>},      {"instances", to<&Job::instances>},
    {"vary", to<&Job::vary>},         {"values", to<&Job::values>},
};

bool take(Job& job, const std::string& word, std::istringstream& line) {
  unsigned reference = 0;
  double number = 0;
  const auto* known =
      std::find_if(std::begin(words), std::end(words), [&](const Word& each) { return word == each.word; });
  if (known != std::end(words))
    known->take(job, line);
  else if (word == "real" && line >> reference >> number)
    job.reals.emplace_back(reference, number);
  else if (word == "string" && line >> reference)
    job.strings.emplace_back(reference, rest(line));
  else
    return false;
  return !line.fail();
}

// Whether the numbers form whole rows with one entry per variable.
bool fits(const std::vector<fmi2ValueReference>& variables, const std::vector<double>& rows) {
  return variables.empty() == rows.empty() && (variables.empty() || rows.size() % variables.size() == 0);
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
  if (!fits(job.inputs, job.motion))
    throw std::runtime_error("the job's rows of inputs do not fit the number of inputs");
  if (!fits(job.vary, job.values))
    throw std::runtime_error("the job's rows of values do not fit the number of varied parameters");
  return job;
}

}  // namespace redysim::drive
