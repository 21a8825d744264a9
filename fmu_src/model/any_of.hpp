#pragma once

namespace redysim {

// Like std::any_of, but without libstdc++'s loop unrolling: for code that runs once.
template <class Range, class Test>
bool any_of(const Range& range, const Test& test) {
  for (const auto& each : range)
    if (test(each)) return true;
  return false;
}

}  // namespace redysim
