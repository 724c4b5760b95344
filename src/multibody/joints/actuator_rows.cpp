// For a given control the effort of an actuator is affine in its length L and rate L': F - k L - d L',
// clipped. With k, d >= 0 it is a spring and damper of bounded effort, one row of the problem (drive_terms),
// and pushes against an obstacle with its full effort. Terms that push in the direction of motion instead (k
// or d < 0) take their values at the start of the step. An effort without either is a load.
#include "multibody/joints/actuator_rows.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "multibody/joints/transmissions.hpp"

namespace amontons {
namespace {

double clipped_control(const Actuator& actuator, double u) {
  return std::clamp(u, actuator.lower_control, actuator.upper_control);
}

// The factor of the gain: control or activation.
double drive_of(const ActuatorCommand& command, const Actuator& actuator, Index index) {
  const double u = clipped_control(actuator, command.controls[index]);
  if (actuator.dynamics == ActivationKind::none) return u;
  const double w = command.state.activations[index];
  return actuator.early ? next_activation(actuator, u, w, command.h) : w;
}

// With L = G l the effort along l is G times that along L, and its coefficients are G^2 times as large.
EffortLaw law_of(const Actuator& actuator, double w, const LineState& line) {
  const double G = actuator.transmission.gear;
  const auto coefficient = [&](int i) { return actuator.gain[i] * w + actuator.bias[i]; };
  if (G == 0) return {};
  const double k = -G * G * coefficient(1), d = -G * G * coefficient(2);
  EffortLaw law{G * coefficient(0), std::max(k, 0.0), std::max(d, 0.0), G * actuator.lower_force,
                G * actuator.upper_force};
  law.effort -= std::min(k, 0.0) * line.length + std::min(d, 0.0) * line.rate;
  if (G < 0) std::swap(law.lower, law.upper);
  return law;
}

}  // namespace

double next_activation(const Actuator& actuator, double control, double w, double h) {
  const double u = clipped_control(actuator, control);
  if (actuator.dynamics == ActivationKind::integrator) w += h * u;
  // Exact for a control that is constant over the step, stable for any.
  if (actuator.dynamics == ActivationKind::filter)
    w = actuator.time_constant > 0 ? w - elementary::expm1(-h / actuator.time_constant) * (u - w) : u;
  return std::clamp(w, actuator.lower_activation, actuator.upper_activation);
}

EffortLaw present_law(const ActuatorCommand& command, Index index, const LineState& line) {
  const Actuator& actuator = command.model.description().actuators[index];
  return law_of(actuator, drive_of(command, actuator, index), line);
}

double known_effort(const EffortLaw& law) { return std::clamp(law.effort, law.lower, law.upper); }

bool has_row(const ActuatorCommand& command, Index index) {
  const EffortLaw law = present_law(command, index, {0, 0});
  return law.stiffness > 0 || law.damping > 0;
}

void append_actuator(const RowInput& in, Index index, const ActuatedLine& line, JointRows& rows) {
  const Actuator& actuator = in.model.description().actuators[index];
  const double h = in.options.h, s = line.scale, G = actuator.transmission.gear;
  const EffortLaw law =
      present_law({in.model, in.state, effort_controls(in), h}, index, {line.length, line.rate});
  // A servo of a rotation takes the shorter direction: its target minus its length is known only up to turns.
  double length = line.length;
  const double turn = turn_of(actuator.transmission);
  if (turn > 0 && law.stiffness > 0)
    length += turn * std::round((law.effort / law.stiffness - length) / turn);
  // The stored impulse is along L = G l.
  RowTag tag{RowKind::actuator, index, 0};
  tag.scale = s / G;
  std::optional<RowTerms> terms;
  if (law.stiffness > 0 || law.damping > 0)
    terms = drive_terms({law.stiffness, length, law.damping, 0, 0, law.effort, line.rate}, s,
                        line.inverse_mass ? *line.inverse_mass : inverse_effective_mass(line.row, in.bodies),
                        in.options);
  if (!terms) {
    tag.scale = 1 / G;
    if (G != 0) rows.efforts.push_back({tag, in.options.kick * known_effort(law)});
    return;
  }
  terms->c += line.offset;
  append_bounded(in.options.kick * law.lower / s, in.options.kick * law.upper / s,
                 {line.row, in.state.actuator_impulses[index] * G / s, tag}, *terms, rows);
}

void append_actuator_rows(const RowInput& in, JointRows& rows) {
  for (const Index a : in.model.other_actuators()) {
    const Transmission& t = in.model.description().actuators[a].transmission;
    Line line = transmission_line(in.model, in.bodies.frames, t);
    const double rate = row_velocity(line.row, in.bodies.start);
    const double s = turn_of(t) > 0 ? in.model.length() : 1;  // the row of a torque is that of an angle
    line.row.scale(s);
    const double inverse_mass = inverse_effective_mass(line.row, in.bodies.mobility);
    if (inverse_mass == 0) continue;
    const NarrowRow narrow = narrowed(line.row, in.bodies, 0, {RowKind::actuator, a, -1}, rows);
    append_actuator(in, a, {narrow.row, s, inverse_mass, line.length, rate}, rows);
  }
}

}  // namespace amontons
