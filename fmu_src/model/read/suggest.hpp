#pragma once

#include <string>
#include <vector>

namespace redysim {

// "; did you mean 'mass'?" if `word` is another common name or a likely misspelling of a candidate, or a
// candidate without its index ("com" for "com[1]"). Empty if there is no such candidate.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

// "'a', 'b' or 'c'"
std::string one_of(const std::vector<std::string>& words);

}  // namespace redysim
