#pragma once
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"

// Couplings of coordinates, C = q_a - p(q_b) = 0 with a polynomial p: gears, mimicking fingers, held dofs.
namespace amontons {

// C, and the slope p'(q_b).
struct CouplingValue {
  double violation, slope;
};
CouplingValue coupling_value(const Model& model, const Coupling& coupling, const State& state);

void append_coupling_rows(const Model& model, const StepBodies& bodies, const State& state,
                          const JointOptions& options, JointRows& rows);

}  // namespace amontons
