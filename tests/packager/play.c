/* Plays an FMU's library on Linux and on Windows: play LIBRARY KIND RESOURCES TOKEN STATES STEP STEPS INPUTS OUTPUTS. KIND is 2cs, 2me, 3cs or
   3me: the version of FMI and co-simulation or model exchange, which integrates by Euler's method and needs the number of STATES. The last two
   are value references with commas between. The inputs change at each step; the outputs of each step go to stdout, every digit. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#include <shellapi.h>
/* the words of main are in a code page, which may not hold a path */
static wchar_t *wide_word(int i) {
  int count = 0;
  return CommandLineToArgvW(GetCommandLineW(), &count)[i];
}
static void *open_library(char **words) {
  (void)words;
  return LoadLibraryW(wide_word(1));
}
/* FMI has strings in UTF-8 */
static char *utf8_word(char **words, int i) {
  const int size = WideCharToMultiByte(CP_UTF8, 0, wide_word(i), -1, 0, 0, 0, 0);
  char *text = malloc((size_t)size);
  (void)words;
  WideCharToMultiByte(CP_UTF8, 0, wide_word(i), -1, text, size, 0, 0);
  return text;
}
static void *symbol(void *library, const char *name) { return (void *)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
static void *open_library(char **words) { return dlopen(words[1], RTLD_NOW); }
static char *utf8_word(char **words, int i) { return words[i]; }
static void *symbol(void *library, const char *name) { return dlsym(library, name); }
#endif

/* declares the function `name` of one version of FMI, from the library */
#define BIND(version, name) version##name##TYPE *name = (version##name##TYPE *)symbol(library, #version #name)

enum { MOST = 200 };

typedef struct {
  int exchange; /* 1: model exchange */
  char *resources, *token;
  size_t states, n, m;
  double step;
  int steps;
  unsigned inputs[MOST], outputs[MOST];
} Job;

static void log_fmi2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                     fmi2String category, fmi2String message, ...) {
  (void)environment, (void)name, (void)status, (void)category;
  va_list arguments;
  va_start(arguments, message);
  vfprintf(stderr, message, arguments);
  va_end(arguments);
  fputc('\n', stderr);
}

static void log_fmi3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                     fmi3String message) {
  (void)environment, (void)status, (void)category;
  fprintf(stderr, "%s\n", message);
}

static size_t references(char *text, unsigned *list) {
  size_t count = 0;
  while (*text && count < MOST) {
    list[count++] = (unsigned)strtoul(text, &text, 10);
    if (*text) ++text;
  }
  return count;
}

static void fill(double *values, int k, size_t n) {
  for (size_t i = 0; i < n; ++i) values[i] = 0.01 * (double)((k + (int)i) % 7 - 3);
}

static void print(const double *values, size_t m) {
  for (size_t i = 0; i < m; ++i) printf("%.17g ", values[i]);
  printf("\n");
}

static void euler(double *x, const double *slopes, const Job *job) {
  for (size_t i = 0; i < job->states; ++i) x[i] += job->step * slopes[i];
}

static int play2(void *library, const Job *job) {
  BIND(fmi2, Instantiate);
  BIND(fmi2, SetupExperiment);
  BIND(fmi2, EnterInitializationMode);
  BIND(fmi2, ExitInitializationMode);
  BIND(fmi2, EnterEventMode);
  BIND(fmi2, NewDiscreteStates);
  BIND(fmi2, EnterContinuousTimeMode);
  BIND(fmi2, GetContinuousStates);
  BIND(fmi2, GetDerivatives);
  BIND(fmi2, SetTime);
  BIND(fmi2, SetContinuousStates);
  BIND(fmi2, CompletedIntegratorStep);
  BIND(fmi2, SetReal);
  BIND(fmi2, GetReal);
  BIND(fmi2, DoStep);
  BIND(fmi2, FreeInstance);
  double values[MOST], x[MOST], slopes[MOST];
  fmi2EventInfo event;
  const fmi2CallbackFunctions callbacks = {log_fmi2, calloc, free, 0, 0};
  const fmi2Type type = job->exchange ? fmi2ModelExchange : fmi2CoSimulation;
  fmi2Component c = Instantiate("played", type, job->token, job->resources, &callbacks, fmi2False, fmi2False);
  if (!c) return 4;
  if (SetupExperiment(c, fmi2False, 0, 0, fmi2False, 0) || EnterInitializationMode(c) ||
      ExitInitializationMode(c))
    return 5;
  if (job->exchange && (NewDiscreteStates(c, &event) || EnterContinuousTimeMode(c))) return 5;
  for (int k = 0; k < job->steps; ++k) {
    fmi2Boolean enter = fmi2False, end = fmi2False;
    fill(values, k, job->n);
    if (job->n && SetReal(c, job->inputs, job->n, values)) return 6;
    if (!job->exchange) {
      if (DoStep(c, k * job->step, job->step, fmi2True)) return 7;
    } else {
      if (GetContinuousStates(c, x, job->states) || GetDerivatives(c, slopes, job->states)) return 7;
      euler(x, slopes, job);
      if (SetTime(c, (k + 1) * job->step) || SetContinuousStates(c, x, job->states)) return 7;
      if (CompletedIntegratorStep(c, fmi2True, &enter, &end)) return 7;
      if (enter && (EnterEventMode(c) || NewDiscreteStates(c, &event) || EnterContinuousTimeMode(c)))
        return 7;
    }
    if (GetReal(c, job->outputs, job->m, values)) return 8;
    print(values, job->m);
  }
  FreeInstance(c);
  return 0;
}

static int play3(void *library, const Job *job) {
  BIND(fmi3, InstantiateCoSimulation);
  BIND(fmi3, InstantiateModelExchange);
  BIND(fmi3, EnterInitializationMode);
  BIND(fmi3, ExitInitializationMode);
  BIND(fmi3, EnterEventMode);
  BIND(fmi3, UpdateDiscreteStates);
  BIND(fmi3, EnterContinuousTimeMode);
  BIND(fmi3, GetContinuousStates);
  BIND(fmi3, GetContinuousStateDerivatives);
  BIND(fmi3, SetTime);
  BIND(fmi3, SetContinuousStates);
  BIND(fmi3, CompletedIntegratorStep);
  BIND(fmi3, SetFloat64);
  BIND(fmi3, GetFloat64);
  BIND(fmi3, DoStep);
  BIND(fmi3, FreeInstance);
  double values[MOST], x[MOST], slopes[MOST], time;
  fmi3Boolean flags[5];
  fmi3Instance c =
      job->exchange
          ? InstantiateModelExchange("played", job->token, job->resources, fmi3False, fmi3False, 0, log_fmi3)
          : InstantiateCoSimulation("played", job->token, job->resources, fmi3False, fmi3False, fmi3False,
                                    fmi3False, 0, 0, 0, log_fmi3, 0);
  if (!c) return 4;
  if (EnterInitializationMode(c, fmi3False, 0, 0, fmi3False, 0) || ExitInitializationMode(c)) return 5;
#define EVENT() UpdateDiscreteStates(c, flags, flags + 1, flags + 2, flags + 3, flags + 4, &time)
  if (job->exchange && (EVENT() || EnterContinuousTimeMode(c))) return 5;
  for (int k = 0; k < job->steps; ++k) {
    fill(values, k, job->n);
    if (job->n && SetFloat64(c, job->inputs, job->n, values, job->n)) return 6;
    if (!job->exchange) {
      if (DoStep(c, k * job->step, job->step, fmi3True, flags, flags + 1, flags + 2, &time)) return 7;
    } else {
      if (GetContinuousStates(c, x, job->states) || GetContinuousStateDerivatives(c, slopes, job->states))
        return 7;
      euler(x, slopes, job);
      if (SetTime(c, (k + 1) * job->step) || SetContinuousStates(c, x, job->states)) return 7;
      if (CompletedIntegratorStep(c, fmi3True, flags, flags + 1)) return 7;
      if (flags[0] && (EnterEventMode(c) || EVENT() || EnterContinuousTimeMode(c))) return 7;
    }
    if (GetFloat64(c, job->outputs, job->m, values, job->m)) return 8;
    print(values, job->m);
  }
  FreeInstance(c);
  return 0;
}

int main(int count, char **words) {
  if (count != 10) return 2;
  void *library = open_library(words);
  if (!library) return 3;
  Job job = {.exchange = !strcmp(words[2] + 1, "me"), .resources = utf8_word(words, 3), .token = words[4]};
  job.states = strtoul(words[5], 0, 10);
  job.step = atof(words[6]);
  job.steps = atoi(words[7]);
  if (job.states > MOST) return 2;
  job.n = references(words[8], job.inputs);
  job.m = references(words[9], job.outputs);
  return words[2][0] == '2' ? play2(library, &job) : play3(library, &job);
}
