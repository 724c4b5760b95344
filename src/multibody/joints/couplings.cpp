// A coupling is an equality between two coordinates, each of a joint or a tendon, or between one and a
// constant. Unlike the rows of a joint it involves any number of bodies.
#include "multibody/joints/couplings.hpp"

#include <algorithm>
#include <cmath>

#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/tendons.hpp"
#include "multibody/joints/wide_rows.hpp"

namespace amontons {
namespace {

double value_of(const Coordinate& c, const Model& model, const BodyFrames& bodies, const State& state) {
  return c.tendon >= 0 ? tendon_length(model, bodies, state, c.tendon)
                       : state.coordinates[model.first_dof(c.joint) + c.dof];
}

// Adds the row of a coordinate's rate, times s and a factor.
void add_rate(const RowInput& in, const Coordinate& c, double s, double factor, WideRow& wide) {
  if (c.tendon >= 0)
    return wide.add(tendon_line(in.model, in.bodies.frames, in.joints, in.state, c.tendon).row, s * factor);
  const JointContext& context = in.joints[c.joint];
  wide.add(joint_row(context, s * context.duals[c.dof]), factor);
}

// Backlash: the violation C stays in [-half, half], which is half + C >= 0 and half - C >= 0, one for each
// flank. Flanks press and never pull. Between them the coupling has no row, and both gears move freely.
struct Backlash {
  double violation, half;
};
void append_flanks(const RowInput& in, const WideRow& wide, const Backlash& between, double x0,
                   const RowTag& tag, JointRows& rows) {
  const auto& [violation, half] = between;
  const double speed =
      std::max(std::abs(row_velocity(wide, in.bodies.start)), std::abs(row_velocity(wide, in.bodies.free)));
  const auto near = [&](double gap) { return within_reach(gap, speed, in.options); };
  if (!near(half + violation) && !near(half - violation)) return;
  const NarrowRow narrow = narrowed(wide, in.bodies, x0, tag, rows);
  for (const double sign : {1.0, -1.0}) {
    const double gap = half + sign * violation;
    if (!near(gap)) continue;
    RowTag flank = tag;
    flank.sign = sign;
    rows.append(NonNegative{}, sign * narrow.row,
                {0, closing(gap, in.options) + sign * narrow.offset, Restraint::inequality, gap},
                std::max(sign * x0, 0.0), flank);
  }
}

}  // namespace

// Coordinates include full turns, so a gear of ratio n stays exact over many turns.
CouplingValue coupling_value(const Model& model, const Coupling& c, const BodyFrames& bodies,
                             const State& state) {
  const bool has_b = c.joint_b >= 0 || c.tendon_b >= 0;
  const double q = has_b ? value_of(coordinate_b(c), model, bodies, state) : 0;
  // Horner's rule, with the derivative.
  double value = 0, slope = 0;
  for (std::size_t i = c.coefficients.size(); i-- > 0;) {
    slope = slope * q + value;
    value = value * q + c.coefficients[i];
  }
  if (!has_b) slope = 0;
  return {value_of(coordinate_a(c), model, bodies, state) - value, slope};
}

double coupling_scale(const Model& model, const Coupling& c) {
  if (c.tendon_a >= 0) return tendon_scale(model, c.tendon_a);
  return model.joint(c.joint_a).dofs[c.dof_a].kind == Dof::Kind::hinge ? model.length() : 1;
}

// D = dC/dt: rate_a - p'(b) rate_b, times the scale s of a. A coupling of two dofs that share a body (gears
// on one frame) involves three bodies, one within a joint two.
void append_coupling_rows(const RowInput& in, JointRows& rows) {
  const auto& couplings = in.model.description().couplings;
  for (std::size_t k = 0; k < couplings.size(); ++k) {
    const Coupling& c = couplings[k];
    const CouplingValue value = coupling_value(in.model, c, in.bodies.frames, in.state);
    const double s = coupling_scale(in.model, c);
    WideRow wide;
    add_rate(in, coordinate_a(c), s, 1, wide);
    if (value.slope != 0) add_rate(in, coordinate_b(c), s, -value.slope, wide);
    const double inverse_mass = inverse_effective_mass(wide, in.bodies.mobility);
    if (inverse_mass == 0) continue;  // no body moves
    // The row is s C: the compliance of the coordinate is s^2 times that of the row, its impulse 1 / s.
    RowTerms terms = equality_terms(s * value.violation, s * s * c.compliance, inverse_mass, in.options);
    const double x0 = in.state.coupling_impulses[k] / s;
    // The report uses the row whose tag has dof 0.
    RowTag tag{RowKind::coupling, static_cast<Index>(k), 0};
    tag.scale = s;
    if (c.backlash > 0) {
      append_flanks(in, wide, {s * value.violation, 0.5 * s * c.backlash}, x0, tag, rows);
      continue;
    }
    const NarrowRow narrow = narrowed(wide, in.bodies, x0, tag, rows);
    terms.c += narrow.offset;
    rows.append(Bilateral{}, narrow.row, terms, x0, tag);
  }
}

}  // namespace amontons
