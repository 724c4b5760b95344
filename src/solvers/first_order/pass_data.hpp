// Private: the data layout of the fused contact passes (contact_passes.hpp).
#pragma once
#include <cstddef>
#include <cstdint>

namespace amontons {

// Contacts are stored in batches of eight, component by component, so that one instruction processes the same
// component of eight contacts. A batch never contains two contacts of one moving body: its impulses can be
// scattered in any order, eight at a time, without a lost addition. Short batches are padded with inert lanes
// of zeros (mu = 0, p = p_inverse = 0, both bodies the dummy; aspect = 1), which add zero to every sum.
// All vectors are in world coordinates: the cone is circular, and its tangents need not be known.
//
// Eight lanes for every register width (8, 4 or 2): the sums then have the same order everywhere.
inline constexpr std::size_t lanes = 8;

// Constant data of a solve: 16 cache lines. Arms in m from the centres of mass to the point, the normal from
// B to A. p is the entry of P (1/kg), p_inverse = 1/p, stored because division is slow. aspect, p_t and 1/p_t
// are the metric of accelerated methods (metric.hpp). A line offset is that of a working velocity in `lines`,
// in doubles (8 per line).
struct alignas(64) ContactBatch {
  double r_a[3][lanes], r_b[3][lanes], normal[3][lanes];
  double mu[lanes], p[lanes], p_inverse[lanes];
  std::uint32_t line_a[lanes], line_b[lanes];
  double aspect[lanes], p_t[lanes], p_t_inverse[lanes];  // last: most passes do not read them
};

// The action of the rows of eight contacts on their bodies if they are given as rows of D, as in files. Per
// row: the force on A, whose opposite acts on B, and the moments on both. x is then in the frames of the
// file, in which every normal is (1, 0, 0), and the batch has no arms.
struct alignas(64) ContactRows {
  double force[3][3][lanes], moment_a[3][3][lanes], moment_b[3][3][lanes];
};

// Eight stored rows of D, (linear, angular) of each body padded with two zeros to the length of a line, with
// their intervals [lo, hi]. Free and nonnegative rows have infinite bounds. compliance is the entry of E.
// Rows of a batch may share bodies. Short batches are padded with rows of zeros at the dummy.
struct alignas(64) JointBatch {
  double a[lanes][8], b[lanes][8];
  double compliance[lanes], p[lanes], p_inverse[lanes], lo[lanes], hi[lanes];
  std::uint32_t line_a[lanes], line_b[lanes];
};

// Inverse masses of eight consecutive lines: 1/m and the inverse inertia as xx, yy, zz, xy, xz, yz. weight
// is 1 for one line of each body and 0 for its copies, so that sums over lines are sums over bodies.
struct alignas(64) MassBatch {
  double translation[lanes], inertia[6][lanes], weight[lanes];
};

// The unit of work of a thread: consecutive batches, of contacts and of joint rows, and the lines that they
// touch. No other chunk touches these lines, so threads need no lock. Between the passes the sums of bodies
// in several chunks are added, copy by copy. first_line and last_line are multiples of eight. The first line
// is a dummy for the world and for fixed bodies, with inverse mass zero. Ranges are half-open.
struct Chunk {
  std::size_t first_batch, last_batch, first_joint, last_joint, first_line, last_line;
};

// The data of the passes; the roles of the three buffers of x change from iteration to iteration.
//
//  x, x_next, y, u, u_y, d, b   24 doubles per batch (three components of eight lanes), then 8 per batch of
//               rows
//  de_saxce        mu |u_t| for the u of x, 8 per batch; coulomb only
//  compliance   E, 8 per batch; null if all are zero
//  lines        one line of 64 bytes per touched body: (linear, angular) and two unused doubles
//  y, u_y       the extrapolated point and A y + b, of accelerated methods; null for the others
//
// `lines` holds impulses at the centres of mass, D'd or D'x, after a direction or impulse pass, and the
// velocities M^-1 D'd or M^-1 D'x after the mass pass.
struct PassData {
  const ContactBatch* batches;
  const ContactRows* contact_rows;  // null if contacts are given by their arms and normals
  const JointBatch* joints;
  const MassBatch* masses;
  const double *compliance, *x, *b;
  double *x_next, *u, *d, *de_saxce, *lines;
  double *y, *u_y;
  std::size_t joint_offset;  // offset of the joint rows in x, u, d, b
  bool coulomb, streaming;   // streaming: the arrays are far larger than the cache of a core
};

// The sums of a pass over one chunk, in a cache line of their own, as each is written by one thread. Sums
// that a pass does not form are zero.
struct alignas(64) PassSums {
  double v[4];
};

}  // namespace amontons
