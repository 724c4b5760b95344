// Private to *.isa.cpp: rows of joints, one by one, and the lines of their bodies.
#pragma once
#include "solvers/first_order/contact_lanes.hpp"
#include "solvers/first_order/pass_data.hpp"

namespace amontons::AMONTONS_ISA {
namespace {

// One line or one side of a joint row: eight doubles, of which the last two mean nothing. Single rows are
// worked on one by one, components side by side in a register: joints differ too much to fill lanes of
// eight.
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

// Consecutive rows of one joint share their bodies: they are worked on together, with the lines in registers.
AMONTONS_INLINE std::size_t end_of_joint(const PassData& data, const Chunk& chunk, std::size_t first) {
  const JointRow& row = data.joints[first];
  std::size_t i = first + 1;
  while (i < chunk.last_joint && data.joints[i].line_a == row.line_a && data.joints[i].line_b == row.line_b)
    ++i;
  return i;
}

// lines += D'f with f = impulse(row, index).
template <class Impulse>
AMONTONS_INLINE void scatter_joints(const PassData& data, const Chunk& chunk, Impulse impulse) {
  for (std::size_t i = chunk.first_joint, last; i < chunk.last_joint; i = last) {
    last = end_of_joint(data, chunk, i);
    Line a = {}, b = {};
    for (std::size_t j = i; j < last; ++j) {
      const JointRow& row = data.joints[j];
      const Vec f = Vec{} + impulse(row, j);
      for (int k = 0; k < 8 / width; ++k) {
        a.v[k] += f * load(row.a + k * width);
        b.v[k] += f * load(row.b + k * width);
      }
    }
    add_to_line(data.lines + data.joints[i].line_a, a);
    add_to_line(data.lines + data.joints[i].line_b, b);
  }
}

// Calls use(row, index, velocity) with velocity = D lines of the row. The six products of a row are added in
// one order, ((0 1) (2 3)) (4 5), on every width; the two doubles of padding are left out.
template <class Use>
AMONTONS_INLINE void gather_joints(const PassData& data, const Chunk& chunk, Use use) {
  for (std::size_t i = chunk.first_joint, last; i < chunk.last_joint; i = last) {
    last = end_of_joint(data, chunk, i);
    const Line a = load_line(data.lines + data.joints[i].line_a);
    const Line b = load_line(data.lines + data.joints[i].line_b);
    for (std::size_t j = i; j < last; ++j) {
      const JointRow& row = data.joints[j];
      alignas(64) double s[8];
      for (int k = 0; k < 8 / width; ++k)
        store(s + k * width, a.v[k] * load(row.a + k * width) + b.v[k] * load(row.b + k * width));
      use(row, j, ((s[0] + s[1]) + (s[2] + s[3])) + (s[4] + s[5]));
    }
  }
}

// The projection on the interval of a row; comparisons with infinite bounds are false.
AMONTONS_INLINE double clip(double z, const JointRow& row) {
  return z < row.lo ? row.lo : (z > row.hi ? row.hi : z);
}

// The same of a row: x - lo or x - hi where the trial point is clipped, the step itself where it is not.
AMONTONS_INLINE double natural_map(const JointRow& row, double x, double u) {
  const double step = row.p_inverse * u, trial = x - step;
  const double e = trial < row.lo ? x - row.lo : (trial > row.hi ? x - row.hi : step);
  return row.p * (e * e);
}

}  // namespace
}  // namespace amontons::AMONTONS_ISA
