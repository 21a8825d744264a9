#include "model/read/link_table.hpp"

#include "model/model.hpp"

namespace redysim {

std::string rigid_pair(int a, int b, const LinkTable& links) {
  const auto name = [&](int link) { return link == ground ? "ground" : "'" + links.names[link] + "'"; };
  const auto carrier = [&](int link) { return link == ground ? ground : links.carriers[link]; };
  if (a == b) return "link_a and link_b are both " + name(a);
  if (links.carriers.empty() || carrier(a) != carrier(b)) return {};
  return "link_a " + name(a) + " and link_b " + name(b) + " are rigidly connected";
}

}  // namespace redysim
