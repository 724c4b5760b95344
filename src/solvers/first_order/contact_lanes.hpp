// Private to *.isa.cpp: native vectors of `width` lanes of a batch, and their exchange with body lines.
// Everything is in the namespace of the instruction set, so that no two variants share a symbol. For the same
// reason nothing here calls an inline function of the standard library. The linker keeps one copy of such a
// function for the whole program, perhaps one with instructions that the processor lacks.
#pragma once
#include <cstdint>

#include "amontons/base/native_vector.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace amontons::AMONTONS_ISA {
namespace {

// Always inlined: a call would pass vectors through memory.
#define AMONTONS_INLINE inline __attribute__((always_inline))

// Aligned access: every offset in the arrays of the passes is a multiple of the width.
AMONTONS_INLINE Vec load(const double* p) { return *reinterpret_cast<const Vec*>(p); }
AMONTONS_INLINE void store(double* p, Vec v) { *reinterpret_cast<Vec*>(p) = v; }

// Correctly rounded on every instruction set, so the bits agree.
AMONTONS_INLINE Vec square_root(Vec v) {
#if defined(__AVX512F__)
  return (Vec)_mm512_maskz_sqrt_pd(0xff, (__m512d)v);  // the plain form warns in GCC 12
#elif defined(__AVX2__)
  return (Vec)_mm256_sqrt_pd((__m256d)v);
#elif defined(__SSE2__)
  return (Vec)_mm_sqrt_pd((__m128d)v);
#else
  return Vec{__builtin_sqrt(v[0]), __builtin_sqrt(v[1])};
#endif
}

// Three components, or six, of `width` contacts.
struct Vec3 {
  Vec x, y, z;
};
struct Vec6 {
  Vec v[6];
};

// Loads from an array of a ContactBatch at a lane; loads and stores of a vector in the layout of x, with
// components 8 doubles apart.
AMONTONS_INLINE Vec3 load3(const double (&p)[3][8], int lane) {
  return {load(p[0] + lane), load(p[1] + lane), load(p[2] + lane)};
}
AMONTONS_INLINE Vec3 load3(const double* p) { return {load(p), load(p + 8), load(p + 16)}; }
AMONTONS_INLINE void store3(double* p, const Vec3& a) {
  store(p, a.x);
  store(p + 8, a.y);
  store(p + 16, a.z);
}

// The components are added in the written order; no compiler may reorder them.
AMONTONS_INLINE Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
AMONTONS_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
AMONTONS_INLINE Vec3 operator*(Vec s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
AMONTONS_INLINE Vec dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
AMONTONS_INLINE Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Exchanges six components, one vector each, with `width` lines (0 1 2 3 | 4 5 - -): a transpose in
// registers. It costs far less than gather instructions because a line is read in two loads. The two spare
// doubles of a line may hold anything.
//  gather       component k of line at[l] to lane l of vector k
//  scatter_add  lines += vectors; all loads come before all stores, so that lanes which share a dummy line
//               do not wait for each other (the value of a dummy is irrelevant: M^-1 makes it zero)
//  scatter      lines = vectors
// The four shuffles are the same on every set, within each group of four lanes:
//  even  (a0 b0 a2 b2)    odd   (a1 b1 a3 b3)
//  low   (a0 a1 b0 b1)    high  (a2 a3 b2 b3)
// so that low and high of even and odd transpose 4 x 4: with lines a, b, c, d as rows
//  low(even(a, b), even(c, d)) = (a0 b0 c0 d0),   low(odd(a, b), odd(c, d)) = (a1 b1 c1 d1),
// and high the same of components 2 and 3.
#if defined(__AVX512F__)

AMONTONS_INLINE Vec even(Vec a, Vec b) { return __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14); }
AMONTONS_INLINE Vec odd(Vec a, Vec b) { return __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15); }
AMONTONS_INLINE Vec low(Vec a, Vec b) { return __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13); }
AMONTONS_INLINE Vec high(Vec a, Vec b) { return __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15); }

// Loads the first four doubles of two lines, or the last pairs of four lines, into one register. Masked
// broadcasts from memory leave the shuffle port free, which the transposes keep busy.
AMONTONS_INLINE Vec load_quads(const double* first, const double* second) {
  const __m512d a = _mm512_castpd256_pd512(_mm256_load_pd(first));
  return (Vec)_mm512_mask_broadcast_f64x4(a, 0xf0, _mm256_load_pd(second));
}
AMONTONS_INLINE Vec load_pairs(const double* p0, const double* p1, const double* p2, const double* p3) {
  __m512d a = _mm512_castpd128_pd512(_mm_load_pd(p0));
  a = _mm512_mask_broadcast_f64x2(a, 0x0c, _mm_load_pd(p1));
  a = _mm512_mask_broadcast_f64x2(a, 0x30, _mm_load_pd(p2));
  return (Vec)_mm512_mask_broadcast_f64x2(a, 0xc0, _mm_load_pd(p3));
}

// quad[i] holds components 0 1 2 3 of lines i and i + 4, so that both groups of four are transposed together.
// pair[i] holds components 4 5 of lines i, i + 2, i + 4 and i + 6.
AMONTONS_INLINE Vec6 gather(const double* lines, const std::uint32_t* at) {
  Vec quad[4], pair[2];  // lines i and i + 4; lines i, i + 2, i + 4 and i + 6
  for (int i = 0; i < 4; ++i) quad[i] = load_quads(lines + at[i], lines + at[i + 4]);
  for (int i = 0; i < 2; ++i)
    pair[i] =
        load_pairs(lines + at[i] + 4, lines + at[i + 2] + 4, lines + at[i + 4] + 4, lines + at[i + 6] + 4);
  const Vec e0 = even(quad[0], quad[1]), e2 = even(quad[2], quad[3]);
  const Vec o0 = odd(quad[0], quad[1]), o2 = odd(quad[2], quad[3]);
  return {low(e0, e2),          low(o0, o2), high(e0, e2), high(o0, o2), even(pair[0], pair[1]),
          odd(pair[0], pair[1])};
}

// Lines ready to be stored.
struct Rows {
  Vec line[8];
};
// The inverse transpose. q_i are components 0 1 2 3 of lines i and i + 4. p0 and p1 are the pairs of even and
// of odd lines, in the order 0, 2, 4, 6. A line takes four doubles from q_i and two from p0 or p1; the rest
// is padding.
AMONTONS_INLINE Rows rows(const Vec6& c) {
  const Vec e0 = low(c.v[0], c.v[2]), e2 = high(c.v[0], c.v[2]);
  const Vec o0 = low(c.v[1], c.v[3]), o2 = high(c.v[1], c.v[3]);
  const Vec q0 = even(e0, o0), q1 = odd(e0, o0), q2 = even(e2, o2), q3 = odd(e2, o2);
  const Vec p0 = even(c.v[4], c.v[5]), p1 = odd(c.v[4], c.v[5]);
  return {{__builtin_shufflevector(q0, p0, 0, 1, 2, 3, 8, 9, 10, 11),
           __builtin_shufflevector(q1, p1, 0, 1, 2, 3, 8, 9, 10, 11),
           __builtin_shufflevector(q2, p0, 0, 1, 2, 3, 10, 11, 12, 13),
           __builtin_shufflevector(q3, p1, 0, 1, 2, 3, 10, 11, 12, 13),
           __builtin_shufflevector(q0, p0, 4, 5, 6, 7, 12, 13, 14, 15),
           __builtin_shufflevector(q1, p1, 4, 5, 6, 7, 12, 13, 14, 15),
           __builtin_shufflevector(q2, p0, 4, 5, 6, 7, 14, 15, 12, 13),
           __builtin_shufflevector(q3, p1, 4, 5, 6, 7, 14, 15, 12, 13)}};
}
AMONTONS_INLINE void add_lines(Rows& r, const double* lines, const std::uint32_t* at) {
  for (int i = 0; i < 8; ++i) r.line[i] += load(lines + at[i]);
}
AMONTONS_INLINE void store_lines(double* lines, const std::uint32_t* at, const Rows& r) {
  for (int i = 0; i < 8; ++i) store(lines + at[i], r.line[i]);
}

#elif defined(__AVX2__)

AMONTONS_INLINE Vec even(Vec a, Vec b) { return __builtin_shufflevector(a, b, 0, 4, 2, 6); }
AMONTONS_INLINE Vec odd(Vec a, Vec b) { return __builtin_shufflevector(a, b, 1, 5, 3, 7); }
AMONTONS_INLINE Vec low(Vec a, Vec b) { return __builtin_shufflevector(a, b, 0, 1, 4, 5); }
AMONTONS_INLINE Vec high(Vec a, Vec b) { return __builtin_shufflevector(a, b, 2, 3, 6, 7); }

// The transposes are of four doubles here; the last two of a line use half a register.
using Vec2 = double __attribute__((vector_size(16), may_alias));
AMONTONS_INLINE Vec2 load2(const double* p) { return *reinterpret_cast<const Vec2*>(p); }
AMONTONS_INLINE void store2(double* p, Vec2 v) { *reinterpret_cast<Vec2*>(p) = v; }
//  (a0 a1 b0 b1)
AMONTONS_INLINE Vec join(Vec2 a, Vec2 b) {
  return (Vec)_mm256_insertf128_pd(_mm256_castpd128_pd256((__m128d)a), (__m128d)b, 1);
}

// quad[i] is the front of line i, pair[i] the ends of lines i and i + 2.
AMONTONS_INLINE Vec6 gather(const double* lines, const std::uint32_t* at) {
  Vec quad[4], pair[2];
  for (int i = 0; i < 4; ++i) quad[i] = load(lines + at[i]);
  for (int i = 0; i < 2; ++i) pair[i] = join(load2(lines + at[i] + 4), load2(lines + at[i + 2] + 4));
  const Vec e0 = even(quad[0], quad[1]), e2 = even(quad[2], quad[3]);
  const Vec o0 = odd(quad[0], quad[1]), o2 = odd(quad[2], quad[3]);
  return {low(e0, e2),          low(o0, o2), high(e0, e2), high(o0, o2), even(pair[0], pair[1]),
          odd(pair[0], pair[1])};
}

// Components 0 to 3, and 4 and 5, of each line; the spare doubles are not touched.
struct Rows {
  Vec quad[4];
  Vec2 pair[4];
};
AMONTONS_INLINE Rows rows(const Vec6& c) {
  const Vec e0 = low(c.v[0], c.v[2]), e2 = high(c.v[0], c.v[2]);
  const Vec o0 = low(c.v[1], c.v[3]), o2 = high(c.v[1], c.v[3]);
  const Vec p0 = even(c.v[4], c.v[5]), p1 = odd(c.v[4], c.v[5]);
  return {{even(e0, o0), odd(e0, o0), even(e2, o2), odd(e2, o2)},
          {__builtin_shufflevector(p0, p0, 0, 1), __builtin_shufflevector(p1, p1, 0, 1),
           __builtin_shufflevector(p0, p0, 2, 3), __builtin_shufflevector(p1, p1, 2, 3)}};
}
AMONTONS_INLINE void add_lines(Rows& r, const double* lines, const std::uint32_t* at) {
  for (int i = 0; i < 4; ++i) {
    r.quad[i] += load(lines + at[i]);
    r.pair[i] += load2(lines + at[i] + 4);
  }
}
AMONTONS_INLINE void store_lines(double* lines, const std::uint32_t* at, const Rows& r) {
  for (int i = 0; i < 4; ++i) {
    store(lines + at[i], r.quad[i]);
    store2(lines + at[i] + 4, r.pair[i]);
  }
}

#else

// Two lanes: 2 x 2 transposes, three for a pair of lines.
AMONTONS_INLINE Vec even(Vec a, Vec b) { return __builtin_shufflevector(a, b, 0, 2); }
AMONTONS_INLINE Vec odd(Vec a, Vec b) { return __builtin_shufflevector(a, b, 1, 3); }

AMONTONS_INLINE Vec6 gather(const double* lines, const std::uint32_t* at) {
  const double *a = lines + at[0], *b = lines + at[1];
  return {even(load(a), load(b)),        odd(load(a), load(b)),          even(load(a + 2), load(b + 2)),
          odd(load(a + 2), load(b + 2)), even(load(a + 4), load(b + 4)), odd(load(a + 4), load(b + 4))};
}

// Three pairs of components for each of two lines.
struct Rows {
  Vec line[2][3];
};
AMONTONS_INLINE Rows rows(const Vec6& c) {
  return {{{even(c.v[0], c.v[1]), even(c.v[2], c.v[3]), even(c.v[4], c.v[5])},
           {odd(c.v[0], c.v[1]), odd(c.v[2], c.v[3]), odd(c.v[4], c.v[5])}}};
}
AMONTONS_INLINE void add_lines(Rows& r, const double* lines, const std::uint32_t* at) {
  for (int i = 0; i < 2; ++i)
    for (int k = 0; k < 3; ++k) r.line[i][k] += load(lines + at[i] + 2 * k);
}
AMONTONS_INLINE void store_lines(double* lines, const std::uint32_t* at, const Rows& r) {
  for (int i = 0; i < 2; ++i)
    for (int k = 0; k < 3; ++k) store(lines + at[i] + 2 * k, r.line[i][k]);
}

#endif

AMONTONS_INLINE void scatter_add(double* lines, const std::uint32_t* at, const Vec6& c) {
  Rows r = rows(c);
  add_lines(r, lines, at);
  store_lines(lines, at, r);
}
AMONTONS_INLINE void scatter(double* lines, const std::uint32_t* at, const Vec6& c) {
  store_lines(lines, at, rows(c));
}

// Sums over the batches of a chunk, per lane, added in a fixed order at the end. There are eight partial sums
// on every instruction set, in 1, 2 or 4 registers each, so that the bits do not depend on the width.
template <int count>
struct LaneSums {
  Vec v[count][8 / width] = {};

  // A tree of pairs: shorter than a chain, and the rounding grows only with its height.
  double total(int i) const {
    double s[8];
    for (int part = 0; part < 8 / width; ++part)
      for (int l = 0; l < width; ++l) s[part * width + l] = v[i][part][l];
    return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
  }
};

}  // namespace
}  // namespace amontons::AMONTONS_ISA
