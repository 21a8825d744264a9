#include "model/read/coupling_reader.hpp"

#include <algorithm>
#include <cmath>

#include "model/read/joint_index.hpp"

namespace redysim {
namespace {

constexpr double default_width = 0.1;  // relative to the backlash

void read_joints(Coupling& coupling, Section& section, const JointIndex& index) {
  if (!section.has("joints")) section.error("joints", "joints is required (a list of two or more joints)");
  for (const auto& [name, place] : section.texts("joints")) {
    const int link = index.find(name, "joints", place, section);
    if (link < 0) continue;
    if (std::count(coupling.links.begin(), coupling.links.end(), link) > 0)
      section.error(place, "joints lists '" + name + "' twice");
    else
      coupling.links.push_back(link);
  }
}

void read_ratios(Coupling& coupling, Section& section, bool joints_are_sound) {
  if (!section.has("ratios")) section.error("ratios", "ratios is required (one number for each joint)");
  if (!section.numbers("ratios", coupling.ratios)) return;
  if (joints_are_sound && coupling.ratios.size() != coupling.links.size())
    section.error("ratios", "ratios must have one number for each of the " +
                                std::to_string(coupling.links.size()) + " joints, got " +
                                std::to_string(coupling.ratios.size()));
  if (std::count(coupling.ratios.begin(), coupling.ratios.end(), 0.0) > 0)
    section.error("ratios", "ratios must not be 0");
}

// Reads the fields of an elastic coupling.
void read_elasticity(Coupling& coupling, Section& section) {
  coupling.stiffness = section.number("stiffness", 0, Bound::positive);
  coupling.damping = section.number("damping", 0, Bound::not_negative);
  coupling.backlash = section.number("backlash", 0, Bound::not_negative);
  coupling.width = section.number("width", default_width * coupling.backlash, Bound::positive);
  if (!section.has("stiffness"))
    for (const char* key : {"damping", "backlash", "width"})
      if (section.has(key)) section.error(key, std::string(key) + " requires stiffness");
  if (section.has("width") && !section.has("backlash")) section.error("width", "width requires backlash");
}

Coupling read_coupling(Section section, const std::string& label, const JointIndex& index, Names& names) {
  Coupling coupling;
  const std::size_t errors_before = section.error_count();
  coupling.name = names.take(section, label);
  coupling.line = section.place().line;
  coupling.column = section.place().column;
  read_joints(coupling, section, index);
  const bool sound = section.error_count() == errors_before;
  if (sound && coupling.links.size() < 2)
    section.error("joints", "joints must be two or more; drive 'locked' holds a single joint");
  read_ratios(coupling, section, sound);
  coupling.offset = section.number("offset", 0);
  read_elasticity(coupling, section);
  section.refuse_unknown();
  return coupling;
}

// The rigid couplings as rows [ratios | offset] of a linear system, reduced row by row.
class CouplingRows {
 public:
  explicit CouplingRows(std::size_t link_count) : link_count_(link_count) {}

  // Whether a row is independent of the previous ones, follows from them, or contradicts them.
  enum class Rank { independent, repeated, contradictory };
  Rank add(const Coupling& coupling) {
    std::vector<double> row(link_count_ + 1, 0.0);
    row[link_count_] = coupling.offset;
    double largest = 0, terms = std::abs(coupling.offset);
    for (std::size_t k = 0; k < coupling.links.size(); ++k) {
      row[static_cast<std::size_t>(coupling.links[k])] = coupling.ratios[k];
      largest = std::max(largest, std::abs(coupling.ratios[k]));
    }
    for (const Reduced& other : rows_) {
      const double part = row[other.pivot] / other.row[other.pivot];
      if (part == 0) continue;
      for (std::size_t i = 0; i <= link_count_; ++i) row[i] -= part * other.row[i];
      row[other.pivot] = 0;
      terms = std::max(terms, std::abs(part * other.row[link_count_]));
    }
    const auto pivot = std::max_element(row.begin(), row.end() - 1,
                                        [](double x, double y) { return std::abs(x) < std::abs(y); });
    if (std::abs(*pivot) > rounding * largest) {
      rows_.push_back({row, static_cast<std::size_t>(pivot - row.begin())});
      return Rank::independent;
    }
    return std::abs(row[link_count_]) > rounding * terms ? Rank::contradictory : Rank::repeated;
  }

 private:
  static constexpr double rounding = 1e-9;  // relative precision of the numbers in the file
  struct Reduced {
    std::vector<double> row;
    std::size_t pivot;
  };
  std::size_t link_count_;
  std::vector<Reduced> rows_;
};

}  // namespace

std::vector<Coupling> read_couplings(Section& top, const Model& model, Names& names, Findings& findings) {
  std::vector<Coupling> couplings;
  const std::vector<const Value*> tables = top.tables("coupling");
  if (tables.empty()) return couplings;
  const JointIndex index(model);
  CouplingRows rows(model.links.size());
  for (const Value* table : tables) {
    const std::string label = label_of("coupling", couplings.size() + 1, *table);
    Section section(*table, label, findings);
    const std::size_t errors_before = section.error_count();
    couplings.push_back(read_coupling(section, label, index, names));
    if (section.error_count() > errors_before || !couplings.back().rigid()) continue;
    const CouplingRows::Rank rank = rows.add(couplings.back());
    if (rank == CouplingRows::Rank::contradictory)
      section.error("offset", "the couplings before this one require another offset");
    if (rank == CouplingRows::Rank::repeated)
      section.warn("joints", "the couplings before this one already imply it; they share the multiplier");
  }
  return couplings;
}

}  // namespace redysim
