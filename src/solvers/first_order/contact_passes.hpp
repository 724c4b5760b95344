// Private: the data layout of the fused contact passes (contact_passes.isa.cpp) and their declarations.
#pragma once
#include <cstddef>
#include <cstdint>

#include "amontons/base/isa.hpp"

namespace amontons {

// Contacts are held in batches of eight, component by component; a batch never has two contacts on one moving
// body, so that its impulses can be scattered without order. Short batches are filled with inert lanes of
// zeros. All vectors are in world coordinates.
inline constexpr std::size_t lanes = 8;

// What is constant during a solve: 13 cache lines. A line offset is that of a working velocity in `lines`,
// counted in doubles.
struct alignas(64) ContactBatch {
  double r_a[3][lanes], r_b[3][lanes], normal[3][lanes];
  double mu[lanes], p[lanes], p_inverse[lanes];
  std::uint32_t line_a[lanes], line_b[lanes];
};

// One stored row of D, each side padded with two zeros, with its interval; free and nonnegative rows have
// infinite bounds.
struct alignas(64) JointRow {
  double a[8], b[8];
  double compliance, p, p_inverse, lo, hi;
  std::uint32_t line_a, line_b;
};

// Inverse masses of eight consecutive lines. weight is 1 for one line of each body and 0 for its copies, so
// that sums over lines are sums over bodies.
struct alignas(64) MassBatch {
  double translation[lanes], inertia[6][lanes], weight[lanes];
};

// The unit of work of a thread: consecutive batches and joint rows and the lines that they touch, which no
// other chunk touches. first_line and last_line are multiples of eight; the first line is a dummy for the
// world and for fixed bodies, whose inverse mass is zero.
struct Chunk {
  std::size_t first_batch, last_batch, first_joint, last_joint, first_line, last_line;
};

// x, x_next, y, u, u_y, d and b hold 24 doubles per batch (three components of eight lanes), then one per
// joint row; saxce holds mu |u_t| for the u of the next direction, 8 per batch (coulomb only); compliance 8
// per batch, null if all zero. lines holds one 64-byte line per touched body: (linear, angular) and two
// unused doubles. y and u_y = A y + b are the extrapolated point of accelerated methods, null for the others.
struct PassData {
  const ContactBatch* batches;
  const JointRow* joints;
  const Chunk* chunks;
  const MassBatch* masses;
  const double *compliance, *x, *b;
  double *x_next, *u, *d, *saxce, *lines;
  double *y, *u_y;
  std::size_t joint_offset;  // of the joint rows in x, u, d, b
  bool coulomb, streaming;   // streaming: the arrays are far larger than the cache of a core
};

// The sums of a pass over one chunk: a cache line of their own, as each is written by one thread.
struct alignas(64) PassSums {
  double v[4];
};

// The passes over one chunk, and their sums.
//   direction_pass   d = Pi_K(x - alpha / p g) - x, lines = D'd: <d, g>, <d, P d>, <d, E d>
//   impulse_pass     lines = D'x: none
//   mass_pass        lines = M^-1 lines: <lines, M^-1 lines>
//   update_pass      with lines = M^-1 D'd: x_next = x + lambda d, u += lambda (D lines + E d): <s, y>,
//                    <y, P^-1 y>, the squared natural map at x_next
//   refresh_pass     with lines = M^-1 D'x: u = D lines + E x + b: the squared natural map
//   momentum_direction_pass   as direction_pass from y and u_y; and <d, P (y - x)>
//   accelerate_pass  with lines = M^-1 D'd: x_next = y + d, u its A x + b, y = x_next + beta (x_next - x),
//   u_y
//                    likewise: the squared natural map at x_next
AMONTONS_FOR_EACH_ISA(PassSums direction_pass(const PassData& data, const Chunk& chunk, double alpha);
                      PassSums impulse_pass(const PassData& data, const Chunk& chunk);
                      PassSums mass_pass(const PassData& data, const Chunk& chunk);
                      PassSums update_pass(const PassData& data, const Chunk& chunk, double lambda);
                      PassSums refresh_pass(const PassData& data, const Chunk& chunk);
                      PassSums momentum_direction_pass(const PassData& data, const Chunk& chunk,
                                                       double alpha);
                      PassSums accelerate_pass(const PassData& data, const Chunk& chunk, double beta);)

// The same, chosen once: one entry per instruction set.
struct Passes {
  using Pass = PassSums (*)(const PassData&, const Chunk&);
  using Step = PassSums (*)(const PassData&, const Chunk&, double);
  Step direction;
  Pass impulse, mass;
  Step update;
  Pass refresh;
  Step momentum_direction, accelerate;
};
Passes passes_of(Isa isa);

}  // namespace amontons
