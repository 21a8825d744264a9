#pragma once

namespace redysim {

// Like std::any_of and std::find, but without libstdc++'s loop unrolling: for code that runs once.
template <class Range, class Test>
bool any_of(const Range& range, const Test& test) {
  for (const auto& each : range)
    if (test(each)) return true;
  return false;
}

template <class Range, class Value>
bool contains(const Range& range, const Value& value) {
  return any_of(range, [&](const auto& each) { return each == value; });
}

}  // namespace redysim
