#include "amontons/base/isa.hpp"

#include <cstdlib>
#include <string_view>
#if defined(AMONTONS_X86)
#include <cpuid.h>
#endif

namespace amontons {

namespace {
#if defined(AMONTONS_X86)
// Reads the processor itself, because the table of __builtin_cpu_supports is not filled by every compiler's
// runtime library. Bits of Intel's manual, volume 2, CPUID, and volume 1, 13.3 (XCR0): a set counts if the
// processor has it and the system saves its registers. The AVX-512 variant needs conversions of integers (dq)
// and masks on shorter registers (vl) besides the base set (f); processors with only f count as AVX2.
Isa best_isa() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  constexpr unsigned osxsave = 1u << 27, avx2 = 1u << 5, f = 1u << 16, dq = 1u << 17, vl = 1u << 31;
  if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & osxsave)) return Isa::baseline;
  unsigned saved = 0, upper = 0;
  __asm__("xgetbv" : "=a"(saved), "=d"(upper) : "c"(0));
  constexpr unsigned ymm = 0x6, zmm = 0xe6;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || !(b & avx2) || (saved & ymm) != ymm) return Isa::baseline;
  return (b & f) && (b & dq) && (b & vl) && (saved & zmm) == zmm ? Isa::avx512 : Isa::avx2;
}
#endif

// AMONTONS_ISA cannot exceed the best set.
Isa detect() {
#if defined(AMONTONS_X86)
  const Isa best = best_isa();
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

// Evaluated once: the processor does not change, and a change of the environment must not change results.
Isa active_isa() {
  static const Isa isa = detect();
  return isa;
}

}  // namespace amontons
