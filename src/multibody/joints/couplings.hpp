#pragma once
#include "multibody/joints/row_terms.hpp"

// Couplings of coordinates, C = a - p(b) = 0 with a polynomial p, of joints and of lengths of tendons: gears,
// mimicking fingers, held dofs.
namespace amontons {

// A coordinate of a coupling: that of a joint's dof or, if a tendon is given, its length.
struct Coordinate {
  Index joint, dof, tendon;
};
inline Coordinate coordinate_a(const Coupling& c) { return {c.joint_a, c.dof_a, c.tendon_a}; }
inline Coordinate coordinate_b(const Coupling& c) { return {c.joint_b, c.dof_b, c.tendon_b}; }

// C, and the slope p'(b).
struct CouplingValue {
  double violation, slope;
};
CouplingValue coupling_value(const Model& model, const Coupling& coupling, const BodyFrames& bodies,
                             const State& state);

// The factor of its row: Model::length() if a is an angle, otherwise 1.
double coupling_scale(const Model& model, const Coupling& coupling);

void append_coupling_rows(const RowInput& in, JointRows& rows);

}  // namespace amontons
