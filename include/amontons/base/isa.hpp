#pragma once

namespace amontons {

// Hot kernels (src/**/*.isa.cpp) are compiled once per instruction set and chosen here at run time. All
// variants give the same bits: the same eight-lane vectors, no contraction into fused multiply-adds.
enum class Isa : unsigned char { baseline, avx2, avx512 };

// The best set that this processor and this build have. The environment variable AMONTONS_ISA
// (baseline | avx2 | avx512) lowers it, for tests.
Isa active_isa();

}  // namespace amontons

// Declares f in the namespace of each instruction set, and dispatch calls:  AMONTONS_DISPATCH(f, args...)
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
