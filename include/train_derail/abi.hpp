// Whether the program's containers are the library's.
#pragma once

namespace train_derail {

/// With -D_GLIBCXX_DEBUG the containers of the standard library have another layout. The library defines one of these
/// two: a program that is compiled the other way cannot be linked, where it would have crashed. Cure: the macro for
/// both, or for neither.
extern const bool compiled_with_GLIBCXX_DEBUG, compiled_without_GLIBCXX_DEBUG;

namespace {
#ifdef _GLIBCXX_DEBUG
[[gnu::used]] const bool* const same_containers = &compiled_with_GLIBCXX_DEBUG;
#else
[[gnu::used]] const bool* const same_containers = &compiled_without_GLIBCXX_DEBUG;
#endif
}  // namespace

}  // namespace train_derail
