#pragma once

namespace amontons {

// Hot kernels (src/**/*.isa.cpp) are compiled once per instruction set and selected here at run time, so that
// one binary runs everywhere and uses the features of the processor. All variants give the same bits. Each
// element gets the same operations in the same order, sums run over eight lanes for every register width, and
// nothing is contracted into fused multiply-adds (-ffp-contract=off).
enum class Isa : unsigned char { baseline, avx2, avx512 };

// The best instruction set that both this processor and this build support. The environment variable
// AMONTONS_ISA (baseline | avx2 | avx512) lowers it, for tests.
Isa active_isa();

}  // namespace amontons

// AMONTONS_FOR_EACH_ISA(declaration) declares a kernel in the namespace of each instruction set, and
//   AMONTONS_DISPATCH(f, args...)
// calls the variant for this processor. The selection costs some nanoseconds and the call is never inlined:
// dispatch whole loops, not single operations.
#if defined(AMONTONS_X86)
#define AMONTONS_DISPATCH(f, ...)                                                           \
  (::amontons::active_isa() == ::amontons::Isa::avx512 ? ::amontons::avx512::f(__VA_ARGS__) \
   : ::amontons::active_isa() == ::amontons::Isa::avx2 ? ::amontons::avx2::f(__VA_ARGS__)   \
                                                       : ::amontons::baseline::f(__VA_ARGS__))
#define AMONTONS_FOR_EACH_ISA(declaration) \
  namespace baseline {                     \
  declaration                              \
  }                                        \
  namespace avx2 {                         \
  declaration                              \
  }                                        \
  namespace avx512 {                       \
  declaration                              \
  }
#else
#define AMONTONS_DISPATCH(f, ...) (::amontons::baseline::f(__VA_ARGS__))
#define AMONTONS_FOR_EACH_ISA(declaration) \
  namespace baseline {                     \
  declaration                              \
  }
#endif
