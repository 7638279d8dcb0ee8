#include "train_derail/abi.hpp"

namespace train_derail {

#ifdef _GLIBCXX_DEBUG
const bool compiled_with_GLIBCXX_DEBUG = true;
#else
const bool compiled_without_GLIBCXX_DEBUG = true;
#endif

}  // namespace train_derail
