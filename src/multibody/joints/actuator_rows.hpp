#pragma once
#include <optional>

#include "amontons/multibody/joints/actuator_command.hpp"
#include "multibody/joints/wide_rows.hpp"

namespace amontons {

// The present law of an actuator along the coordinate l that its gear multiplies: F - k l - d l', clipped to
// [lower, upper].
struct EffortLaw {
  double effort, stiffness, damping, lower, upper;
};
EffortLaw present_law(const ActuatorCommand& command, Index actuator, const LineState& line);
// The effort, known before the step, of a law without stiffness and damping.
double known_effort(const EffortLaw& law);
// Whether an actuator, with its present control, has a row.
bool has_row(const ActuatorCommand& command, Index actuator);

double next_activation(const Actuator& actuator, double control, double activation, double h);

// A coordinate l and its row, D v = s l' (without the offset of a NarrowRow); the actuator moves a multiple
// of l.
struct ActuatedLine {
  JacobianRow row;
  double scale;                        // s
  std::optional<double> inverse_mass;  // of the row; empty: to be found where it is needed
  double length, rate;                 // l and l' at the start of the step
  double offset = 0;
};
// Appends the row of an actuator, or records its known effort.
void append_actuator(const RowInput& in, Index actuator, const ActuatedLine& line, JointRows& rows);

// Rows of all actuators that act on neither a dof nor a tendon.
void append_actuator_rows(const RowInput& in, JointRows& rows);

}  // namespace amontons
