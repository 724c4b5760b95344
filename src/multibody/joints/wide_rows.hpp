#pragma once
#include "multibody/joints/row_terms.hpp"

// Rows over any number of bodies: couplings of joints, tendons.
namespace amontons {

// A row over all its bodies, in order of appearance. A body that occurs again shares its entry, where parts
// add.
struct WideRow {
  std::vector<Index> body;
  std::vector<std::array<double, 6>> j;  // wrench of a unit impulse along the row, about the centre of mass

  // The world has no part, because it does not move.
  void add(Index which, const std::array<double, 6>& part, double factor);
  void add(const JacobianRow& row, double factor);
  void add(const WideRow& row, double factor);
  void scale(double s);
  // One body's part, as a row.
  JacobianRow part(std::size_t i) const { return {body[i], world, j[i], {}}; }
};

// A length that bodies change, and the row of its rate, row v = l'.
struct Line {
  double length = 0;
  WideRow row;
};

// D v and D M^-1 D', the latter a sum over bodies, as M is block-diagonal.
double row_velocity(const WideRow& wide, const BodyVelocities& v);
double inverse_effective_mass(const WideRow& wide, const BodyMobilities& bodies);

// A wide row as the problem can store it: D v = row v + offset, where the velocities of auxiliary bodies
// start at zero. Any number of rows of the problem may share it; each must add the offset to its c.
struct NarrowRow {
  JacobianRow row;
  double offset = 0;
};
// Appends the rows of the auxiliary bodies if the row has more than two bodies. x0: total impulse along the
// row. The tag is for these helpers; their impulses are not stored.
NarrowRow narrowed(const WideRow& wide, const StepBodies& bodies, double x0, RowTag tag, JointRows& rows);

}  // namespace amontons
