// What differs between SUNDIALS 6 (Debian 12) and 7 (Debian 13), under the names of 7.
//
// tell_arkode_errors<Tell>, tell_cvode_errors<Tell>: Tell(message, user) hears of errors, not of warnings.
#pragma once

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_context.h>

namespace train_derail::solver {

#if SUNDIALS_VERSION_MAJOR < 7

inline int create_context(SUNContext* context) { return SUNContext_Create(nullptr, context); }

inline void ARKodeFree(void** memory) { ERKStepFree(memory); }
inline constexpr auto ARKodeEvolve = ERKStepEvolve;
inline constexpr auto ARKodeGetDky = ERKStepGetDky;
inline constexpr auto ARKodeGetNumErrTestFails = ERKStepGetNumErrTestFails;
inline constexpr auto ARKodeGetNumSteps = ERKStepGetNumSteps;
inline constexpr auto ARKodeGetReturnFlagName = ERKStepGetReturnFlagName;
inline constexpr auto ARKodeGetRootInfo = ERKStepGetRootInfo;
inline constexpr auto ARKodeReset = ERKStepReset;
inline constexpr auto ARKodeRootInit = ERKStepRootInit;
inline constexpr auto ARKodeSetFixedStep = ERKStepSetFixedStep;
inline constexpr auto ARKodeSetInterpolantDegree = ERKStepSetInterpolantDegree;
inline constexpr auto ARKodeSetNoInactiveRootWarn = ERKStepSetNoInactiveRootWarn;
inline constexpr auto ARKodeSetUserData = ERKStepSetUserData;
inline constexpr auto ARKodeWFtolerances = ERKStepWFtolerances;

template <auto Tell>
void on_error(int code, const char*, const char*, char* message, void* user) {
  if (code < 0) Tell(message, user);
}
template <auto Tell>
int tell_arkode_errors(SUNContext, void* memory, void* user) {
  return ERKStepSetErrHandlerFn(memory, on_error<Tell>, user);
}
template <auto Tell>
int tell_cvode_errors(SUNContext, void* memory, void* user) {
  return CVodeSetErrHandlerFn(memory, on_error<Tell>, user);
}

#else

inline int create_context(SUNContext* context) { return SUNContext_Create(SUN_COMM_NULL, context); }

template <auto Tell>
void on_error(int, const char*, const char*, const char* message, SUNErrCode code, void* user, SUNContext) {
  if (code < 0) Tell(message, user);
}
template <auto Tell>
int tell_arkode_errors(SUNContext context, void*, void* user) {
  SUNContext_ClearErrHandlers(context);
  return SUNContext_PushErrHandler(context, on_error<Tell>, user);
}
template <auto Tell>
int tell_cvode_errors(SUNContext context, void* memory, void* user) {
  return tell_arkode_errors<Tell>(context, memory, user);
}

#endif

}  // namespace train_derail::solver
