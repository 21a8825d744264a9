#include "model/read/tree.hpp"

#include <algorithm>
#include <functional>
#include <queue>

namespace redysim {
namespace {

void resolve_parents(std::vector<LinkDraft>& drafts) {
  LinkIndex index;
  for (std::size_t i = 0; i < drafts.size(); ++i) index.add(drafts[i].link.name, static_cast<int>(i));
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    LinkDraft& draft = drafts[i];
    draft.link.parent = draft.section.has("parent")
                            ? index.find(draft.parent, "parent", draft.section, ground)
                            : static_cast<int>(i) - 1;
  }
}

// Names of the links along the cycle through `first`.
std::string cycle_text(const std::vector<LinkDraft>& drafts, int first) {
  std::string text = drafts[first].link.name;
  for (int i = drafts[first].link.parent; i != first; i = drafts[i].link.parent)
    text += " -> " + drafts[i].link.name;
  return text + " -> " + drafts[first].link.name;
}

// Reports each cycle of parents once, at its first link in the file, and attaches this link to ground.
void cut_cycles(std::vector<LinkDraft>& drafts) {
  std::vector<int> visit(drafts.size(), -1);  // first link of the walk that visited this link
  for (int start = 0; start < static_cast<int>(drafts.size()); ++start) {
    int i = start;
    while (i != ground && visit[i] < 0) {
      visit[i] = start;
      i = drafts[i].link.parent;
    }
    if (i == ground || visit[i] != start) continue;
    int first = i;
    for (int k = drafts[i].link.parent; k != i; k = drafts[k].link.parent) first = std::min(first, k);
    drafts[first].section.error("parent", "cyclic parent references: " + cycle_text(drafts, first));
    drafts[first].link.parent = ground;
  }
}

// Positions of the links in the file, parents first. The next link is the earliest one whose parent is
// placed.
std::vector<int> parents_first(const std::vector<LinkDraft>& drafts) {
  std::vector<std::vector<int>> children(drafts.size());
  std::priority_queue<int, std::vector<int>, std::greater<>> ready;
  for (int i = 0; i < static_cast<int>(drafts.size()); ++i) {
    const int parent = drafts[i].link.parent;
    if (parent == ground)
      ready.push(i);
    else
      children[parent].push_back(i);
  }
  std::vector<int> order;
  while (!ready.empty()) {
    const int i = ready.top();
    ready.pop();
    order.push_back(i);
    for (const int child : children[i]) ready.push(child);
  }
  return order;
}

}  // namespace

void arrange_tree(std::vector<LinkDraft>& drafts) {
  resolve_parents(drafts);
  cut_cycles(drafts);
  const std::vector<int> order = parents_first(drafts);
  std::vector<int> position(drafts.size());
  for (std::size_t i = 0; i < order.size(); ++i) position[order[i]] = static_cast<int>(i);
  std::vector<LinkDraft> arranged;
  arranged.reserve(drafts.size());
  for (const int i : order) {
    arranged.push_back(std::move(drafts[i]));
    int& parent = arranged.back().link.parent;
    if (parent != ground) parent = position[parent];
  }
  drafts.swap(arranged);
}

}  // namespace redysim
