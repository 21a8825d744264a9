/* An FMU whose faults a driver must find. What it does wrong is its GUID: nan, hang, crash, error, discard, refuse. */
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "fmi2Functions.h"

struct Faulty {
  char fault[16];
  const fmi2CallbackFunctions* callbacks;
  double time;
};

static int is(fmi2Component c, const char* fault) { return strcmp(((struct Faulty*)c)->fault, fault) == 0; }

static struct Faulty only;

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                              const fmi2CallbackFunctions* callbacks, fmi2Boolean visible, fmi2Boolean logging) {
  (void)name, (void)type, (void)place, (void)visible, (void)logging;
  strncpy(only.fault, guid, sizeof only.fault - 1);
  only.callbacks = callbacks;
  return strcmp(guid, "refuse") == 0 ? NULL : &only;
}
void fmi2FreeInstance(fmi2Component c) { (void)c; }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean b, fmi2Real t, fmi2Real s, fmi2Boolean d, fmi2Real e) {
  return (void)c, (void)b, (void)t, (void)s, (void)d, (void)e, fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { return is(c, "error") ? fmi2Error : fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
  return (void)c, (void)r, (void)n, (void)v, fmi2OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]) {
  return (void)c, (void)r, (void)n, (void)v, fmi2OK;
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) {
  return (void)c, (void)r, (void)n, (void)v, fmi2Error;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) {
  return (void)c, (void)r, (void)n, (void)v, fmi2Error;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
  for (size_t i = 0; i < n; ++i) v[i] = is(c, "nan") && ((struct Faulty*)c)->time > 0.25 ? NAN : r[i];
  return fmi2OK;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* v) {
  return (void)kind, *v = ((struct Faulty*)c)->time, fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean b) {
  struct Faulty* f = c;
  (void)b;
  if (time > 0.15) {
    while (is(c, "hang")) sleep(1);
    if (is(c, "crash")) *(volatile int*)16 = 0;
    if (is(c, "discard")) return fmi2Discard;
    if (is(c, "error")) {
      f->callbacks->logger(f->callbacks->componentEnvironment, "x", fmi2Error, "e", "joint '%s' is stuck", "elbow");
      return fmi2Error;
    }
  }
  f->time = time + size;
  return fmi2OK;
}
