#include "multibody/joints/row_terms.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/problem/linkage.hpp"

namespace amontons {

// The velocity after the step is unknown. The reach is twice the fastest known velocity, plus a tenth of a
// length (or rad) for the effect of collisions and other joints. A missed limit is corrected in the next
// step, as a violation. Rows that cannot act would only increase the size of the problem.
bool within_reach(double gap, double speed, const JointOptions& options) {
  return gap <= 2 * options.h * speed + 0.1 * options.length;
}

// The row of an implicit spring k, damper d, inertia a and constant effort F along q follows from its impulse
//   x = h F - h k (stretch + h q'+) - h d q'+ - a (q'+ - q'-):
//   q'+ + E x + c = 0,  E = 1 / (h^2 k + h d + a),  c = E (h k stretch - a q'- - h F)
// (docs/algorithm.md (8); Catto, "Soft constraints", GDC 2011, with the inertia of the drive added). k, d and
// a of an angle are divided by s^2, and F by s, as D v is s q' and x is the impulse over s.
std::optional<RowTerms> drive_terms(const Drive& d, double s, double h) {
  const double k = d.stiffness / (s * s), a = d.inertia / (s * s);
  const double stiff = h * h * k + h * d.damping / (s * s) + a;
  if (stiff == 0) return std::nullopt;
  return RowTerms{1 / stiff, (h * k * s * d.stretch - a * (s * d.rate) - h * d.effort / s) / stiff};
}

// A rigid row keeps its position. Errors are removed by displacing bodies (step/positions), or by velocities
// up to the recovery speed. The force of a spring is not limited, since it would no longer be that spring.
RowTerms equality_terms(double error, double e, double inverse_mass, const JointOptions& options) {
  const double h = options.h, v = options.recovery_speed;
  if (e > 0) return {e / (h * h), error / h};
  return {locked_regularisation * inverse_mass, std::clamp(error / h, -v, v), Restraint::equality, error};
}

double closing(double gap, const JointOptions& options) {
  const double back = -gap <= options.h * options.closing ? options.closing : 0;
  return std::max(gap / options.h, -std::max(options.recovery_speed, back));
}

double inverse_effective_mass(const JacobianRow& row, const StepBodies& bodies) {
  if (!bodies.trees) return inverse_effective_mass(row, bodies.mobility);
  const Linkage& trees = *bodies.trees->linkage;
  return trees.inverse_mass(row) + inverse_effective_mass(trees.without_trees(row), bodies.mobility);
}

// A tree may lock the direction of a row: a planar loop holds itself in its plane. D M^-1 D' with the joints
// of the tree is then zero up to rounding, and a compliance relative to it no compliance. Free bodies set it.
void append_equality(const RowInput& in, const JacobianRow& row, double error, double e, double last,
                     const RowTag& tag, JointRows& rows) {
  const double inverse_mass =
      in.model.lightness(row.body_a, row.body_b) * inverse_effective_mass(row, in.bodies.mobility);
  rows.append(Bilateral{}, row, equality_terms(error, e, inverse_mass, in.options), last, tag);
}

void append_inequality(const RowInput& in, const JacobianRow& row, double gap, double e, double motor_speed,
                       double last, const RowTag& tag, JointRows& rows) {
  if (!(gap < infinity)) return;
  const double start = std::abs(row_velocity(row, in.bodies.start));
  const double free = std::abs(row_velocity(row, in.bodies.free));
  if (!within_reach(gap, std::max({start, free, motor_speed}), in.options)) return;
  const double h = in.options.h;
  RowTerms terms{e / (h * h), gap / h};
  if (e == 0) terms = {0, closing(gap, in.options), Restraint::inequality, gap};
  rows.append(NonNegative{}, row, terms, std::max(last, 0.0), tag);
}

void append_bounded(double bound, const JacobianRow& row, const RowTerms& terms, double last,
                    const RowTag& tag, JointRows& rows) {
  append_bounded(-bound, bound, row, terms, last, tag, rows);
}

void append_bounded(double lower, double upper, const JacobianRow& row, const RowTerms& terms, double last,
                    const RowTag& tag, JointRows& rows) {
  // An interval without ends is the whole line; linear systems are solved faster.
  if (lower == -infinity && upper == infinity) return rows.append(Bilateral{}, row, terms, last, tag);
  rows.append(Interval{lower, upper}, row, terms, std::clamp(last, lower, upper), tag);
}

}  // namespace amontons
