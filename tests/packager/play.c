/* Plays an FMU's library on Linux and on Windows: play LIBRARY URI GUID STEP STEPS INPUTS OUTPUTS, the last two being value
   references with commas between. A torque that changes at each step; the outputs of each step go to stdout, every digit. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#include <shellapi.h>
static void *open_library(const char *path) {
  int count = 0;
  /* the words of main are in a code page, which may not hold the path */
  wchar_t **words = CommandLineToArgvW(GetCommandLineW(), &count);
  (void)path;
  return words && count > 1 ? LoadLibraryW(words[1]) : 0;
}
static void *symbol(void *library, const char *name) { return (void *)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
static void *open_library(const char *path) { return dlopen(path, RTLD_NOW); }
static void *symbol(void *library, const char *name) { return dlsym(library, name); }
#endif

enum { MOST = 200 };

static void log_line(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
  (void)environment, (void)name, (void)status, (void)category;
  va_list arguments;
  va_start(arguments, message);
  vfprintf(stderr, message, arguments);
  va_end(arguments);
  fputc('\n', stderr);
}

static size_t references(char *text, fmi2ValueReference *list) {
  size_t count = 0;
  while (*text && count < MOST) {
    list[count++] = (fmi2ValueReference)strtoul(text, &text, 10);
    if (*text) ++text;
  }
  return count;
}

int main(int count, char **words) {
  fmi2ValueReference inputs[MOST], outputs[MOST];
  double values[MOST];
  if (count != 8) return 2;
  void *library = open_library(words[1]);
  if (!library) return 3;
  fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)symbol(library, "fmi2Instantiate");
  fmi2SetupExperimentTYPE *setup = (fmi2SetupExperimentTYPE *)symbol(library, "fmi2SetupExperiment");
  fmi2EnterInitializationModeTYPE *enter = (fmi2EnterInitializationModeTYPE *)symbol(library, "fmi2EnterInitializationMode");
  fmi2ExitInitializationModeTYPE *leave = (fmi2ExitInitializationModeTYPE *)symbol(library, "fmi2ExitInitializationMode");
  fmi2SetRealTYPE *set_real = (fmi2SetRealTYPE *)symbol(library, "fmi2SetReal");
  fmi2GetRealTYPE *get_real = (fmi2GetRealTYPE *)symbol(library, "fmi2GetReal");
  fmi2DoStepTYPE *do_step = (fmi2DoStepTYPE *)symbol(library, "fmi2DoStep");
  fmi2FreeInstanceTYPE *release = (fmi2FreeInstanceTYPE *)symbol(library, "fmi2FreeInstance");
  const fmi2CallbackFunctions callbacks = {log_line, calloc, free, 0, 0};
  const double step = atof(words[4]);
  const int steps = atoi(words[5]);
  const size_t n = references(words[6], inputs), m = references(words[7], outputs);
  fmi2Component instance = instantiate("played", fmi2CoSimulation, words[3], words[2], &callbacks, fmi2False, fmi2False);
  if (!instance) return 4;
  if (setup(instance, fmi2False, 0, 0, fmi2False, 0) || enter(instance) || leave(instance)) return 5;
  for (int k = 0; k < steps; ++k) {
    for (size_t i = 0; i < n; ++i) values[i] = 0.01 * (double)((k + (int)i) % 7 - 3);
    if (n && set_real(instance, inputs, n, values)) return 6;
    if (do_step(instance, k * step, step, fmi2True)) return 7;
    if (get_real(instance, outputs, m, values)) return 8;
    for (size_t i = 0; i < m; ++i) printf("%.17g ", values[i]);
    printf("\n");
  }
  release(instance);
  return 0;
}
