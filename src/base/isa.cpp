#include "amontons/base/isa.hpp"

#include <cstdlib>
#include <string_view>

namespace amontons {

namespace {
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

Isa active_isa() {
  static const Isa isa = detect();
  return isa;
}

}  // namespace amontons
