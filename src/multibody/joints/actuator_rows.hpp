#pragma once
#include "multibody/joints/wide_rows.hpp"

namespace amontons {

// The present law of an actuator: F - k l - d l', clipped to [lower, upper], along the coordinate l that its
// gear multiplies.
struct EffortLaw {
  double effort, stiffness, damping, lower, upper;
};
EffortLaw present_law(const Model& model, const State& state, Index actuator, double length, double rate,
                      double h);
// The effort of a law without stiffness and damping, which is known before the step.
double known_effort(const EffortLaw& law);
// Whether an actuator, with its present control, has a row.
bool has_row(const Model& model, const State& state, Index actuator, double h);

double next_activation(const Actuator& actuator, double control, double activation, double h);

// A coordinate l of which an actuator moves a multiple, with its row, D v = s l' (less the offset of a
// NarrowRow).
struct ActuatedLine {
  JacobianRow row;
  double scale, length, rate;  // of l, at the start of the step
  double offset = 0;
};
// The row of an actuator, or its known effort for the record.
void append_actuator(const RowInput& in, Index actuator, const ActuatedLine& line, JointRows& rows);

// Rows of all actuators that act on neither a dof nor a tendon.
void append_actuator_rows(const RowInput& in, JointRows& rows);

}  // namespace amontons
