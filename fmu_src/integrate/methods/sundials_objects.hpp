#pragma once

#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>
#include <sundials/sundials_nvector.h>

#include <cstdio>
#include <memory>
#include <new>
#include <type_traits>

#include "integrate/methods/newton_matrix.hpp"
#include "integrate/system/system.hpp"

// Owners of SUNDIALS' C objects. Creation throws std::bad_alloc, the only way in which it fails here.

namespace redysim::sundials {

template <auto Destroy>
struct Destroyer {
  template <class Object>
  void operator()(Object* object) const {
    Destroy(object);
  }
};

using Vector = std::unique_ptr<std::remove_pointer_t<N_Vector>, Destroyer<N_VDestroy>>;
using Matrix = std::unique_ptr<std::remove_pointer_t<SUNMatrix>, Destroyer<SUNMatDestroy>>;
using LinearSolver = std::unique_ptr<std::remove_pointer_t<SUNLinearSolver>, Destroyer<SUNLinSolFree>>;
using NonlinearSolver =
    std::unique_ptr<std::remove_pointer_t<SUNNonlinearSolver>, Destroyer<SUNNonlinSolFree>>;

template <class Pointer>
Pointer created(Pointer pointer) {
  if (!pointer) throw std::bad_alloc();
  return pointer;
}

class Context {
 public:
  Context() {
    if (SUNContext_Create(nullptr, &context_) != 0) throw std::bad_alloc();
  }
  ~Context() { SUNContext_Free(&context_); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  operator SUNContext() const { return context_; }

 private:
  SUNContext context_ = nullptr;
};

// A zero vector in one block of memory, for the short states of robots. The norm includes only components of
// positive weight.
Vector make_vector(long size, SUNContext context);

// A dense square matrix with faster operations.
Matrix make_matrix(long size, SUNContext context);

// A direct solver for dense matrices I - gamma J of the system.
LinearSolver make_linear_solver(const System& system, SUNContext context);
inline NewtonMatrix& newton_matrix(SUNLinearSolver solver) {
  return *static_cast<NewtonMatrix*>(solver->content);
}
inline NewtonMatrix& newton_matrix(const LinearSolver& solver) { return newton_matrix(solver.get()); }

inline double* data(N_Vector vector) { return static_cast<double*>(vector->content); }
inline double* data(const Vector& vector) { return data(vector.get()); }

// Keeps SUNDIALS' last message instead of printing it; `keep` is an ARKErrHandlerFn and CVErrHandlerFn.
struct LastMessage {
  char text[256] = "";
  // Omits SUNDIALS' time, which differs from the system's: "At t = 0 and h = 1e-3, reason" -> "reason"
  const char* reason() const;
  static void keep(int, const char*, const char*, char* message, void* self) {
    std::snprintf(static_cast<LastMessage*>(self)->text, sizeof text, "%s", message);
  }
};

}  // namespace redysim::sundials
