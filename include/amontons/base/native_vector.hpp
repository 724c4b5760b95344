// Private to *.isa.cpp: a register of doubles of the instruction set that the file is compiled for. GCC 12
// turns wider vectors into code through memory. Everything lives in the namespace of the instruction set, so
// that no two variants share a symbol: the linker would keep one of them, perhaps that with instructions
// which the processor lacks.
#pragma once

namespace amontons::AMONTONS_ISA {
namespace {

#if defined(__AVX512F__)
constexpr int width = 8;
#elif defined(__AVX2__)
constexpr int width = 4;
#else
constexpr int width = 2;
#endif

using Vec = double __attribute__((vector_size(8 * width), may_alias));  // in aligned memory
// Anywhere. The attributes stand before the equals sign: Clang takes no alignment from those of the type
// behind it.
using LooseVec __attribute__((vector_size(8 * width), aligned(8), may_alias)) = double;
static_assert(alignof(LooseVec) == alignof(double));

}  // namespace
}  // namespace amontons::AMONTONS_ISA
