/// \file
/// For loops that the compiler vectorises once for each instruction set. The version is chosen when the program runs,
/// by the processor.
#pragma once

// Not with sanitizers: the choice is made before they are ready.
#if defined(TRAIN_DERAIL_X86) && !defined(TRAIN_DERAIL_SANITIZED)
#define TRAIN_DERAIL_WIDE [[gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]]
#else
#define TRAIN_DERAIL_WIDE
#endif
