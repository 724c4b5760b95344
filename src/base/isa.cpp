#include "amontons/base/isa.hpp"

#include <cstdlib>
#include <string_view>

namespace amontons {

namespace {
// The AVX-512 variant needs conversions of integers (dq) and masks on shorter registers (vl) besides the base
// set (f); processors with f alone count as AVX2. A wish for more than there is has no effect.
Isa detect() {
#if defined(AMONTONS_X86)
  Isa best = Isa::baseline;
  if (__builtin_cpu_supports("avx2")) best = Isa::avx2;
  if (best == Isa::avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    best = Isa::avx512;
  if (const char* wish = std::getenv("AMONTONS_ISA")) {
    const std::string_view name = wish;
    if (name == "baseline") return Isa::baseline;
    if (name == "avx2" && best != Isa::baseline) return Isa::avx2;
  }
  return best;
#else
  return Isa::baseline;
#endif
}
}  // namespace

// Asked once: the processor does not change, and the environment must not change results half-way.
Isa active_isa() {
  static const Isa isa = detect();
  return isa;
}

}  // namespace amontons
