// Private to *.isa.cpp: rows of joints, and the lines of their bodies.
#pragma once
#include "solvers/first_order/contact_lanes.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons::AMONTONS_ISA {
namespace {

// One line or one side of a joint row: eight doubles, the last two unused. Accesses of rows to bodies go one
// row at a time, with the components side by side in a register.
struct Line {
  Vec v[8 / width];
};
AMONTONS_INLINE Line load_line(const double* p) {
  Line line;
  for (int k = 0; k < 8 / width; ++k) line.v[k] = load(p + k * width);
  return line;
}
AMONTONS_INLINE void add_to_line(double* p, const Line& line) {
  for (int k = 0; k < 8 / width; ++k) store(p + k * width, load(p + k * width) + line.v[k]);
}

// lines += D'f for the impulses of the joint rows. Consecutive rows of one joint share their bodies, so they
// are added in registers.
AMONTONS_INLINE void scatter_joints(const PassData& data, const Chunk& chunk, const double* impulses) {
  const std::size_t end = lanes * chunk.last_joint;
  for (std::size_t i = lanes * chunk.first_joint; i < end;) {
    const std::uint32_t line_a = data.joints[i / lanes].line_a[i % lanes];
    const std::uint32_t line_b = data.joints[i / lanes].line_b[i % lanes];
    Line a = {}, b = {};
    do {
      const JointBatch& batch = data.joints[i / lanes];
      const Vec f = Vec{} + impulses[i];
      for (int k = 0; k < 8 / width; ++k) {
        a.v[k] += f * load(batch.a[i % lanes] + k * width);
        b.v[k] += f * load(batch.b[i % lanes] + k * width);
      }
      ++i;
    } while (i < end && data.joints[i / lanes].line_a[i % lanes] == line_a &&
             data.joints[i / lanes].line_b[i % lanes] == line_b);
    add_to_line(data.lines + line_a, a);
    add_to_line(data.lines + line_b, b);
  }
}

// D lines of `width` rows of a batch. The six products of a row are added in one order, ((0 1) (2 3)) (4 5),
// for every width, and for all rows together after the transpose.
AMONTONS_INLINE Vec joint_velocities(const PassData& data, const JointBatch& batch, int lane) {
  alignas(64) double products[width][8];
  std::uint32_t at[width];
  for (int l = 0; l < width; ++l) {
    at[l] = 8 * static_cast<std::uint32_t>(l);
    const Line a = load_line(data.lines + batch.line_a[lane + l]);
    const Line b = load_line(data.lines + batch.line_b[lane + l]);
    for (int k = 0; k < 8 / width; ++k)
      store(products[l] + k * width,
            a.v[k] * load(batch.a[lane + l] + k * width) + b.v[k] * load(batch.b[lane + l] + k * width));
  }
  const Vec6 s = gather(products[0], at);
  return ((s.v[0] + s.v[1]) + (s.v[2] + s.v[3])) + (s.v[4] + s.v[5]);
}

// Calls use(batch, lane, part, at) for all joint rows of a chunk, `width` at a time; at: their place in x.
template <class Use>
AMONTONS_INLINE void for_each_joint(const PassData& data, const Chunk& chunk, Use use) {
  for (std::size_t i = chunk.first_joint; i < chunk.last_joint; ++i)
    for (int part = 0; part < 8 / width; ++part)
      use(data.joints[i], part * width, part,
          data.joint_offset + lanes * i + static_cast<std::size_t>(part * width));
}

// The projection on the intervals of rows; comparisons with infinite bounds are false.
AMONTONS_INLINE Vec clip(Vec z, const JointBatch& batch, int lane) {
  const Vec lo = load(batch.lo + lane), hi = load(batch.hi + lane);
  return z < lo ? lo : (z > hi ? hi : z);
}

// p e^2 of the natural map of rows: e = x - lo or x - hi if the trial point is clipped, otherwise the step.
AMONTONS_INLINE Vec natural_map(const JointBatch& batch, int lane, Vec x, Vec u) {
  const Vec lo = load(batch.lo + lane), hi = load(batch.hi + lane);
  const Vec step = load(batch.p_inverse + lane) * u, trial = x - step;
  const Vec e = trial < lo ? x - lo : (trial > hi ? x - hi : step);
  return load(batch.p + lane) * (e * e);
}

}  // namespace
}  // namespace amontons::AMONTONS_ISA
