#pragma once

#include <string>
#include <vector>

namespace redysim {

// "; did you mean 'mass'?" when a candidate is what others call `word`, when `word` is a likely misspelling
// of it, or its first element ("com" for "com[1]"); else empty.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

// "'a', 'b' or 'c'"
std::string one_of(const std::vector<std::string>& words);

}  // namespace redysim
