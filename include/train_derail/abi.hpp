/// \file
/// Guards against a program and a library whose standard containers have different layouts.
#pragma once

namespace train_derail {

/// With -D_GLIBCXX_DEBUG the containers of the standard library have another layout. The library defines only one of
/// these two symbols, and a program refers to the one that fits its own setting. So a program with the other setting
/// fails to link instead of crashing. What helps: define the macro for both, or for neither.
extern const bool compiled_with_GLIBCXX_DEBUG, compiled_without_GLIBCXX_DEBUG;

namespace {
#ifdef _GLIBCXX_DEBUG
[[gnu::used]] const bool* const same_containers = &compiled_with_GLIBCXX_DEBUG;
#else
[[gnu::used]] const bool* const same_containers = &compiled_without_GLIBCXX_DEBUG;
#endif
}  // namespace

}  // namespace train_derail
