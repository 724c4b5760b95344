// Selects the passes of the best instruction set of the processor, or of a given one.
#include "solvers/first_order/contact_passes.hpp"

namespace amontons {

// The macro refers to the passes of one namespace; names are equal in all.
Passes passes_of(Isa isa) {
#define AMONTONS_PASSES(set)                                                                     \
  Passes {                                                                                       \
    set::direction_pass, set::impulse_pass, set::mass_pass, set::update_pass, set::refresh_pass, \
        set::momentum_direction_pass, set::accelerate_pass                                       \
  }
#if defined(AMONTONS_X86)
  if (isa == Isa::avx512) return AMONTONS_PASSES(avx512);
  if (isa == Isa::avx2) return AMONTONS_PASSES(avx2);
#endif
  static_cast<void>(isa);
  return AMONTONS_PASSES(baseline);
#undef AMONTONS_PASSES
}

}  // namespace amontons
