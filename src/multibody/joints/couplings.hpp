#pragma once
#include "multibody/joints/row_terms.hpp"

// Couplings of coordinates, C = q_a - p(q_b) = 0 with a polynomial p: gears, mimicking fingers, held dofs.
namespace amontons {

// C, and the slope p'(q_b).
struct CouplingValue {
  double violation, slope;
};
CouplingValue coupling_value(const Model& model, const Coupling& coupling, const State& state);

void append_coupling_rows(const RowInput& in, JointRows& rows);

}  // namespace amontons
