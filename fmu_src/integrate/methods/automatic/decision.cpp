#include "integrate/methods/automatic/decision.hpp"

#include <cstdio>

#include "model/number.hpp"
#include "model/solver_methods.hpp"

namespace redysim {

std::string Decision::text() const {
  const char *name = method_name(method_of[static_cast<int>(method)]),
             *before = method_name(method_of[static_cast<int>(other)]);
  const std::string at = shown(time), own = rounded(cost), rival = rounded(other_cost);
  char text[200];
  const auto print = [&text](const char* sentence, auto... parts) {
    std::snprintf(text, sizeof text, sentence, parts...);
  };
  if (event == Event::tries)
    print("auto tries %s instead of %s at %s s", name, before, at.c_str());
  else if (event == Event::restarts)
    print("auto continues with %s at %s s: inputs change too often for %s", before, at.c_str(), name);
  else if (event == Event::replaces)
    print("auto continues with %s at %s s: %s failed", before, at.c_str(), name);
  else
    print("auto %s %s at %s s: the time of %s right-hand sides of erk per second, %s took %s",
          event == Event::keeps ? "keeps" : "returns from", name, at.c_str(), own.c_str(), before,
          rival.c_str());
  return text;
}

}  // namespace redysim
