#pragma once

#include <string>
#include <vector>

namespace redysim {

// "; did you mean 'mass'?" if `word` is another common name of a candidate, a likely misspelling of it, or
// its name without index ("com" for "com[1]"); otherwise empty.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

// "'a', 'b' or 'c'"
std::string one_of(const std::vector<std::string>& words);

}  // namespace redysim
