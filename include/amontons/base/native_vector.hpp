// Private to *.isa.cpp: a register of doubles of the instruction set of the compilation. GCC 12 compiles
// wider vectors to code through memory. Everything is in the namespace of the instruction set, so that no two
// variants share a symbol. The linker would keep one of them, perhaps one with instructions that the
// processor lacks.
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

using Vec = double __attribute__((vector_size(8 * width), may_alias));  // aligned memory
// Any address. The attributes precede the equals sign: Clang ignores an alignment in those of the type after
// it.
using LooseVec __attribute__((vector_size(8 * width), aligned(8), may_alias)) = double;
static_assert(alignof(LooseVec) == alignof(double));

}  // namespace
}  // namespace amontons::AMONTONS_ISA
