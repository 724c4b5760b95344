// A coupling is an equality between coordinates of two joints, or of one and a constant. Unlike the other
// rows it is about up to four bodies; where there are more than two it is split.
#include "multibody/joints/couplings.hpp"

#include <algorithm>

#include "multibody/joints/joint_context.hpp"

namespace amontons {
namespace {

using Vec6 = std::array<double, 6>;

// A row over all bodies that it touches, in order of appearance: two joints have four sides, and those that
// are the same body share an entry, where their parts add.
struct WideRow {
  std::size_t n = 0;
  std::array<Index, 4> body;
  std::array<Vec6, 4> j;

  // The world has no part: it does not move.
  void add(Index which, const Vec6& part, double sign) {
    if (which < 0) return;
    std::size_t i = 0;
    while (i < n && body[i] != which) ++i;
    if (i == n) {
      body[n] = which;
      j[n] = Vec6{};
      ++n;
    }
    for (int k = 0; k < 6; ++k) j[i][k] += sign * part[k];
  }
  void add(const JacobianRow& row, double sign) {
    add(row.body_a, row.a, sign);
    add(row.body_b, row.b, sign);
  }
  JacobianRow part(std::size_t i) const { return {body[i], world, j[i], {}}; }
};

// A row of the problem holds two bodies. A wider one, sum_i J_i v_i = 0 with n > 2 bodies, becomes n rows
// over an auxiliary body whose velocity components z_i follow the parts:
//   J_i v_i - z_i = 0 (i < n),   J_n v_n + z_1 + ... + z_(n-1) = 0.
// Each then carries nearly the impulse of the coupling: the inertia of z_i, that of the lightest part times
// `lightness`, is added to the mechanism. z starts the step at J_i v_i, else its inertia would brake.
constexpr double lightness = 1e-4;

// Eliminating z shows that: with M_z = 1 / w the parts' impulses differ from each other by M_z (z_i+ - z_i-),
// which is lightness times a part's own momentum. c of a link is -z_i-, of the last row plus all of them, so
// that a motion which obeys the coupling asks for no impulse.
void append_wide_row(const WideRow& wide, const StepBodies& bodies, RowTerms terms, double x0,
                     const RowTag& tag, JointRows& rows) {
  const std::size_t links = wide.n - 1;
  const Index auxiliary = static_cast<Index>(bodies.frames.size() + rows.auxiliary_inverse_mass.size());
  double heaviest = 0;
  for (std::size_t i = 0; i < wide.n; ++i)
    heaviest = std::max(heaviest, inverse_effective_mass(wide.part(i), bodies.mobility));
  rows.auxiliary_inverse_mass.push_back(heaviest / lightness);
  RowTag helper = tag;
  helper.dof = -1;
  JacobianRow last = wide.part(links);
  last.body_b = auxiliary;
  for (std::size_t i = 0; i < links; ++i) {
    JacobianRow link = wide.part(i);
    const double before = row_velocity(link, bodies.start);
    link.body_b = auxiliary;
    link.b[i] = -1;
    last.b[i] = 1;
    terms.c += before;
    rows.append(Free{}, link, {0, -before}, x0, helper);
  }
  rows.append(Free{}, last, terms, x0, tag);
}

// D = dC/dt: rate_a - p'(q_b) rate_b, times the scale s of a, over up to four bodies. A coupling of two dofs
// that share a body (gears on one frame) has three, of one joint two.
WideRow coupling_row(const RowInput& in, const Coupling& coupling, const JointContext& a, double slope) {
  const double s = a.scale(coupling.dof_a);
  WideRow wide;
  wide.add(joint_row(a, s * a.duals[coupling.dof_a]), 1);
  if (coupling.joint_b < 0 || slope == 0) return wide;
  const JointContext b = joint_context(in.model, in.bodies.frames, in.state, coupling.joint_b);
  wide.add(joint_row(b, s * b.duals[coupling.dof_b]), -slope);
  return wide;
}

}  // namespace

// Coordinates count turns, so that a gear of ratio n stays right over many.
CouplingValue coupling_value(const Model& model, const Coupling& coupling, const State& state) {
  const auto coordinate = [&](Index joint, Index dof) {
    return state.coordinates[model.first_dof(joint) + dof];
  };
  const double q = coupling.joint_b >= 0 ? coordinate(coupling.joint_b, coupling.dof_b) : 0;
  // Horner's rule, with the derivative.
  double value = 0, slope = 0;
  for (std::size_t i = coupling.coefficients.size(); i-- > 0;) {
    slope = slope * q + value;
    value = value * q + coupling.coefficients[i];
  }
  if (coupling.joint_b < 0) slope = 0;
  return {coordinate(coupling.joint_a, coupling.dof_a) - value, slope};
}

void append_coupling_rows(const RowInput& in, JointRows& rows) {
  const auto& couplings = in.model.description().couplings;
  for (std::size_t k = 0; k < couplings.size(); ++k) {
    const Coupling& coupling = couplings[k];
    const CouplingValue value = coupling_value(in.model, coupling, in.state);
    const JointContext a = joint_context(in.model, in.bodies.frames, in.state, coupling.joint_a);
    const double s = a.scale(coupling.dof_a);
    const WideRow wide = coupling_row(in, coupling, a, value.slope);
    // D M^-1 D' is the sum over bodies, as M is block-diagonal.
    double inverse_mass = 0;
    for (std::size_t i = 0; i < wide.n; ++i)
      inverse_mass += inverse_effective_mass(wide.part(i), in.bodies.mobility);
    if (inverse_mass == 0) continue;  // nothing that moves
    // The row is s C: a compliance of the coordinate is s^2 times that of the row, its impulse 1 / s.
    const RowTerms terms =
        equality_terms(s * value.violation, s * s * coupling.compliance, inverse_mass, in.options);
    const double x0 = in.state.coupling_impulses[k] / s;
    // One row, or one over an auxiliary body; the row that bears the tag with dof 0 is the one that is
    // reported.
    RowTag tag{RowKind::coupling, static_cast<Index>(k), 0};
    tag.scale = s;
    if (wide.n > 2) {
      append_wide_row(wide, in.bodies, terms, x0, tag, rows);
      continue;
    }
    JacobianRow row = wide.part(0);
    if (wide.n == 2) {
      row.body_b = wide.body[1];
      row.b = wide.j[1];
    }
    rows.append(Free{}, row, terms, x0, tag);
  }
}

}  // namespace amontons
