#include "model/read/suggest.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

#include "model/any_of.hpp"

namespace redysim {
namespace {

char lower(char letter) { return 'A' <= letter && letter <= 'Z' ? static_cast<char>(letter + 32) : letter; }

// Counts insertions, deletions, replacements and swaps of neighbours (optimal string alignment); ignores
// case.
std::size_t edit_distance(const std::string& first, const std::string& second) {
  std::vector<std::size_t> before(second.size() + 1), above(second.size() + 1), row(second.size() + 1);
  std::iota(above.begin(), above.end(), std::size_t{0});
  for (std::size_t i = 1; i <= first.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= second.size(); ++j) {
      const char a = lower(first[i - 1]), b = lower(second[j - 1]);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a == b ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a == lower(second[j - 2]) && b == lower(first[i - 2]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(above);
    above.swap(row);
  }
  return above[second.size()];
}

// Names that other programs and books use for our fields.
struct OtherName {
  char other[15], ours[16];  // pointers would need relocation when the library is loaded
};
constexpr OtherName other_names[] = {
    {"type", "joint"},
    {"joint_type", "joint"},
    {"length", "a"},
    {"th", "theta"},
    {"alp", "alpha"},
    {"cog", "com"},
    {"cm", "com"},
    {"center_of_mass", "com"},
    {"centre_of_mass", "com"},
    {"I", "inertia"},
    {"coulomb", "friction"},
    {"frictionloss", "friction"},
    {"stiction", "static_friction"},
    {"limit", "lower"},
    {"limits", "lower"},
    {"min", "lower"},
    {"max", "upper"},
    {"range", "lower"},
    {"q0", "q"},
    {"qd0", "qd"},
    {"dq", "qd"},
    {"rotor_inertia", "armature"},
    {"joints", "link"},
    {"body", "link"},
    {"bodies", "link"},
    {"tolerance", "rtol"},
    {"g", "gravity"},
};

}  // namespace

std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates) {
  if (word.size() > 200) return {};
  for (const auto& [other, ours] : other_names)
    if (word == other && contains(candidates, ours)) return "; did you mean '" + std::string(ours) + "'?";
  std::size_t best = std::max<std::size_t>(1, word.size() / 3) + 1;
  const std::string* closest = nullptr;
  for (const std::string& candidate : candidates) {
    if (candidate.compare(0, word.size() + 1, word + "[") == 0) return "; did you mean '" + candidate + "'?";
    const std::size_t longer = std::max(word.size(), candidate.size());
    if (longer - std::min(word.size(), candidate.size()) >= best) continue;
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best && distance < candidate.size()) {
      best = distance;
      closest = &candidate;
    }
  }
  return closest ? "; did you mean '" + *closest + "'?" : std::string{};
}

std::string one_of(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += "'" + words[i] + "'";
  }
  return text;
}

}  // namespace redysim
