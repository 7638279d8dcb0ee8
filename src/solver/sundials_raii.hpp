// Owners of the SUNDIALS objects, and checks that name the call that failed.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <nvector/nvector_serial.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include "sundials_versions.hpp"

namespace train_derail::solver {

template <auto Function>
struct Deleter {
  template <class T>
  void operator()(T* p) const {
    Function(p);
  }
};

inline void free_context(std::remove_pointer_t<SUNContext>* context) { SUNContext_Free(&context); }
inline void free_linear_solver(std::remove_pointer_t<SUNLinearSolver>* solver) { SUNLinSolFree(solver); }

using Context = std::unique_ptr<std::remove_pointer_t<SUNContext>, Deleter<free_context>>;
using Vector = std::unique_ptr<std::remove_pointer_t<N_Vector>, Deleter<N_VDestroy>>;
using Matrix = std::unique_ptr<std::remove_pointer_t<SUNMatrix>, Deleter<SUNMatDestroy>>;
using LinearSolver = std::unique_ptr<std::remove_pointer_t<SUNLinearSolver>, Deleter<free_linear_solver>>;

inline void check(int flag, const char* call) {
  if (flag < 0) throw std::runtime_error(std::string(call) + " failed with code " + std::to_string(flag));
}

template <class T>
T* check_made(T* object, const char* call) {
  if (object == nullptr) throw std::runtime_error(std::string(call) + " returned nothing");
  return object;
}

inline Context make_context() {
  SUNContext context = nullptr;
  check(create_context(&context), "SUNContext_Create");
  return Context(context);
}

}  // namespace train_derail::solver
