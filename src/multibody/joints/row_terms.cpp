#include "multibody/joints/row_terms.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/problem/linkage.hpp"
#include "multibody/joints/policy.hpp"

namespace amontons {

// The velocity after the step is unknown. The reach is twice the fastest known velocity, plus a
// length (or angle) for what is not known. Rows that cannot act would only increase the size of the problem.
bool within_reach(double gap, double speed, const JointOptions& options) {
  return gap <= 2 * options.h * speed + joints::policy.reach * options.length;
}

// The mean of the poses before, at and after the start, (q- + 2 q + q+) / 4, is q + h (q'+ - q'-) / 4. This
// is Newmark's rule of mean accelerations, and here the implicit midpoint rule. If the last step h' is
// another one, each side counts by its length: the first step of all takes the middle of its own way, h q'+
// / 2.
DriveShares drive_shares(double h, double last, double euler) {
  const double middle = 1 - euler;
  const double both = 2 * (h + last);
  return {h * (euler + middle * h / both), -middle * last * last / both, euler + 0.5 * middle, 0.5 * middle};
}

double euler_share(double stiffness, double damping, double inverse_mass, double h) {
  return std::clamp(std::sqrt(h * inverse_mass * (h * stiffness + damping)) - 1, 0.0, 1.0);
}

// An implicit spring k, damper d, inertia a and constant effort F along q have one row. It follows from their
// impulse over the kick K, with the shares s of the rates before and after.
//   x = K F - K k (stretch + s1 q'+ + s2 q'-) - K d (s3 q'+ + s4 q'-) - a (q'+ - q'-):
//   q'+ + E x + c = 0,  E = 1 / (K k s1 + K d s3 + a),
//   c = E (K k (stretch + s2 q'-) + K d s4 q'- - a q'- - K F)
// (docs/algorithm.md (8); Catto, "Soft constraints", GDC 2011, with the inertia of the drive added). k, d and
// a of an angle are divided by s^2, and F by s, as D v is s q' and x is the impulse over s.
std::optional<RowTerms> drive_terms(const Drive& d, double s, double inverse_mass,
                                    const JointOptions& options) {
  const double euler =
      options.dampers ? euler_share(d.stiffness, d.damping, inverse_mass / (s * s), options.h) : 1;
  const DriveShares share = drive_shares(options.h, options.last(), euler);
  const double kick = options.kick;
  const double k = d.stiffness / (s * s), a = d.inertia / (s * s), damping = d.damping / (s * s);
  const double stiff = kick * (k * share.stretch_after + damping * share.rate_after) + a;
  if (stiff == 0) return std::nullopt;
  const double before =
      k * (d.stretch + share.stretch_before * d.speed) + damping * share.rate_before * d.speed;
  return RowTerms{1 / stiff, (s * (kick * before - a * d.rate) - kick * d.effort / s) / stiff};
}

// A rigid row keeps its position. Errors are removed by displacing bodies (step/positions), or by velocities
// up to the recovery speed. The force of a spring is not limited, since it would no longer be that spring.
RowTerms equality_terms(double error, double e, double inverse_mass, const JointOptions& options) {
  const double h = options.h, v = options.recovery_speed;
  if (e > 0) return {e / (h * options.kick), error / h};
  return {base::policy.compliance * inverse_mass, std::clamp(error / h, -v, v), Restraint::equality, error};
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
//
// With trees all errors of a loop are those of its closing rows. They return within D (v- + v+), so v- stays
// the chord between closed poses, and e of step/second_order.cpp stays small. Rows of all joints share their
// errors instead: there each step would feed back the chord's distance from its circle, which is of first
// order.
void append_equality(const RowInput& in, const RowPlace& at, double error, double e, JointRows& rows) {
  const double inverse_mass =
      in.model.lightness(at.row.body_a, at.row.body_b) * inverse_effective_mass(at.row, in.bodies.mobility);
  JointOptions options = in.options;
  if (in.bodies.trees && in.bodies.trees->linkage->touches(at.row))
    options.recovery_speed = options.loop_speed;
  rows.append(Bilateral{}, at.row, equality_terms(error, e, inverse_mass, options), at.last, at.tag);
}

void append_inequality(const RowInput& in, const RowPlace& at, double gap, double e, double motor_speed,
                       JointRows& rows) {
  if (!(gap < infinity)) return;
  const double start = std::abs(row_velocity(at.row, in.bodies.start));
  const double free = std::abs(row_velocity(at.row, in.bodies.free));
  if (!within_reach(gap, std::max({start, free, motor_speed}), in.options)) return;
  const double h = in.options.h;
  RowTerms terms{e / (h * in.options.kick), gap / h};
  if (e == 0) terms = {0, closing(gap, in.options), Restraint::inequality, gap};
  rows.append(NonNegative{}, at.row, terms, std::max(at.last, 0.0), at.tag);
}

void append_bounded(double bound, const RowPlace& at, const RowTerms& terms, JointRows& rows) {
  append_bounded(-bound, bound, at, terms, rows);
}

void append_bounded(double lower, double upper, const RowPlace& at, const RowTerms& terms, JointRows& rows) {
  // An interval without ends is the whole line; linear systems are solved faster.
  if (lower == -infinity && upper == infinity)
    return rows.append(Bilateral{}, at.row, terms, at.last, at.tag);
  rows.append(Interval{lower, upper}, at.row, terms, std::clamp(at.last, lower, upper), at.tag);
}

}  // namespace amontons
