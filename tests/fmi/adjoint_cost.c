/* adjoint_cost LIBRARY TOKEN RESOURCES STATES UNKNOWNS KNOWNS: right-hand sides at new states and adjoint derivatives of a model-exchange
   instance of FMI 3.0, 20 of each, for Callgrind. UNKNOWNS and KNOWNS are value references with commas between. */
#include <dlfcn.h>
#include <stdlib.h>

#include "fmi3FunctionTypes.h"

enum { MOST = 1000, CALLS = 20 };

static void silent(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
  (void)environment, (void)status, (void)category, (void)message;
}

static size_t references(char *text, fmi3ValueReference *list) {
  size_t count = 0;
  while (*text && count < MOST) {
    list[count++] = (fmi3ValueReference)strtoul(text, &text, 10);
    if (*text) ++text;
  }
  return count;
}

int main(int count, char **words) {
  static fmi3ValueReference unknowns[MOST], knowns[MOST];
  static double y[MOST], slopes[MOST], seed[MOST], gradient[MOST];
  if (count != 7) return 2;
  void *library = dlopen(words[1], RTLD_NOW);
  if (!library) return 3;
#define FUNCTION(name) fmi3##name##TYPE *name = (fmi3##name##TYPE *)dlsym(library, "fmi3" #name)
  FUNCTION(InstantiateModelExchange);
  FUNCTION(EnterInitializationMode);
  FUNCTION(ExitInitializationMode);
  FUNCTION(UpdateDiscreteStates);
  FUNCTION(EnterContinuousTimeMode);
  FUNCTION(GetContinuousStates);
  FUNCTION(SetContinuousStates);
  FUNCTION(GetContinuousStateDerivatives);
  FUNCTION(GetAdjointDerivative);
  const size_t n = (size_t)atoi(words[4]), nu = references(words[5], unknowns), nk = references(words[6], knowns);
  fmi3Instance it = InstantiateModelExchange("cost", words[2], words[3], fmi3False, fmi3False, 0, silent);
  fmi3Boolean flags[5];
  fmi3Float64 next;
  if (!it || EnterInitializationMode(it, fmi3False, 0, 0, fmi3False, 0) || ExitInitializationMode(it)) return 4;
  if (UpdateDiscreteStates(it, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4], &next)) return 5;
  if (EnterContinuousTimeMode(it) || GetContinuousStates(it, y, n)) return 6;
  for (size_t i = 0; i < nu; ++i) seed[i] = 1.0 + (double)i;
  for (int k = 0; k < CALLS; ++k) {
    y[0] += 1e-3;
    if (SetContinuousStates(it, y, n) || GetContinuousStateDerivatives(it, slopes, n)) return 7;
    if (GetAdjointDerivative(it, unknowns, nu, knowns, nk, seed, nu, gradient, nk)) return 8;
  }
  return 0;
}
