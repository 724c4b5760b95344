#pragma once
#include "multibody/joints/row_terms.hpp"

// Rows over any number of bodies: couplings of joints, tendons.
namespace amontons {

// A row over all bodies that it touches, in order of appearance; those that come again share an entry, where
// their parts add.
struct WideRow {
  std::vector<Index> body;
  std::vector<std::array<double, 6>> j;  // wrench about the centre of mass of a unit impulse along the row

  // The world has no part: it does not move.
  void add(Index which, const std::array<double, 6>& part, double factor);
  void add(const JacobianRow& row, double factor);
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

// A wide row as the problem can hold it: D v = row v + offset, where the velocities of auxiliary bodies begin
// at zero. Any number of rows of the problem may share it; c of each has to have the offset added.
struct NarrowRow {
  JacobianRow row;
  double offset = 0;
};
// Appends the rows of the auxiliary bodies, if the row is over more than two bodies. x0: of the impulse along
// the row, in all. The tag is for these helpers; their impulses are not kept.
NarrowRow narrowed(const WideRow& wide, const StepBodies& bodies, double x0, RowTag tag, JointRows& rows);

}  // namespace amontons
