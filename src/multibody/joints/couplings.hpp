#pragma once
#include "multibody/joints/row_terms.hpp"

// Couplings of coordinates, C = a - p(b) = 0 with a polynomial p, of joints and of lengths of tendons: gears,
// mimicking fingers, held dofs.
namespace amontons {

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
