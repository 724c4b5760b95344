#include "multibody/step/ahead.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/policy.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/second_order.hpp"

namespace amontons {

namespace {

// The speeds along a row: before the step, without impulses, and after it.
struct RowSpeeds {
  double before, free, after;
};

// A gap that closes with more speed than loads can give it within a few steps strikes.
bool strikes(const RowSpeeds& u, double fall) { return -u.before > smooth_speed(fall, u.free - u.before); }

// Friction that has stopped a motion does not reverse it.
bool stops(double before, double after, double fall) {
  return before > base::policy.three_digits * fall && after < base::policy.three_digits * before;
}

// A solved step. `fall`: the speed that gravity adds; `scale`: the kick over that of the last step, 0 without
// one.
struct SolvedMotion {
  const Observed& o;
  const BodyVelocities& after;
  double h, fall, scale;
};

bool is_rough(const SolvedMotion& in, const Contact& c, double x) {
  if (!(x > 0)) return false;
  double before[3], free[3], then[3];
  const ContactBasis basis(c);
  basis.to_contact(relative_motion(c, in.o.start).linear, before);
  basis.to_contact(relative_motion(c, in.o.free).linear, free);
  basis.to_contact(relative_motion(c, in.after).linear, then);
  return strikes({before[0], free[0], then[0]}, in.fall) ||
         stops(std::hypot(before[1], before[2]), std::hypot(then[1], then[2]), in.fall);
}

// A force that the step does not resolve has taken most of a motion: a stiff damper or spring. `resisted`:
// the inverse mass of the row.
bool takes(double compliance, double resisted, const RowSpeeds& u) {
  return resisted > compliance && std::abs(u.after) < step::policy.rough * std::abs(u.before);
}

// A force along a row that is far from that of the last step, and changes the speed by more than a fall.
bool jumps(double x, double last, const RowSpeeds& u, double fall) {
  return std::abs(x - last) > step::policy.rough * std::max(std::abs(x), std::abs(last)) &&
         std::abs(u.after - u.before) > smooth_speed(fall);
}

// A joint turns the velocity of a body by a large part within the step, which no acceleration describes.
bool swings(const BodyVelocity& before, const BodyVelocity& after, double h) {
  const double change = norm(after.linear - before.linear);
  return h * norm(after.angular) > resolved_turn && change > resolved_turn * norm(after.linear);
}

// Row i of joints with the impulse x.
bool is_rough(const SolvedMotion& in, const JointRows& rows, std::size_t i, double x) {
  if (x == 0) return false;
  const JacobianRow& row = rows.jacobian[i];
  const RowSpeeds u{row_velocity(row, in.o.start), row_velocity(row, in.o.free), row_velocity(row, in.after)};
  const RowKind kind = rows.tags[i].kind;
  if (kind == RowKind::friction) return stops(std::abs(u.before), std::abs(u.after), in.fall);
  // A rate with parts of auxiliary bodies, which rest in these velocities, is not known: only the force
  // tells.
  const auto bodies = static_cast<Index>(in.after.size());
  if (row.body_a >= bodies || row.body_b >= bodies) return jumps(x, in.scale * rows.x0[i], u, in.fall);
  if (rows.restraint[i] == Restraint::inequality) return strikes(u, in.fall);
  if (kind == RowKind::coupling) return false;
  if (kind == RowKind::locked) {
    const auto swinging = [&](Index body) {
      return body >= 0 && swings(in.o.start[body], in.after[body], in.h);
    };
    return swinging(row.body_a) || swinging(row.body_b);
  }
  if (takes(rows.compliance[i], inverse_effective_mass(row, in.o.bodies()), u)) return true;
  if (in.scale > 0) return jumps(x, in.scale * rows.x0[i], u, in.fall);
  return rows.compliance[i] == 0 && std::abs(u.after - u.before) > smooth_speed(in.fall);
}

}  // namespace

// Impulses over the kick changed the velocities from v- to v+, those of two middles. Where forces change
// slowly, they go on as they were: half a step later the velocity is v+ + h / (2 k) (v+ - v-), with an error
// h^2 / 2 of the rate of the acceleration. No second solve at the end of the step is needed. An impulse that
// acted at one instant would be counted half as much again, so that an island with a jump keeps v+. Islands
// are the unit, because a part of a mechanism that jumps moves all of it.
void find_ahead(const StepSetting& step, const StepProblem& posed, double last_kick, const Observed& o,
                Solved& solved, std::vector<double>& ahead) {
  // A solve that missed a tight tolerance may still have the digits that count.
  const bool solved_well =
      !step.damped &&
      (solved.path == StepPath::accurate ||
       (solved.path == StepPath::joints_restored && solved.solution.residual <= base::policy.three_digits));
  const Subset& visited = step.visited.bodies;
  ahead.resize(step.model.bodies());
  visited.each(ahead.size(), [&](std::size_t i) { ahead[i] = solved_well ? step.h / (2 * step.kick()) : 0; });
  if (!solved_well) return;
  const Problem& problem = *posed.problem;
  const SolvedMotion motion{o, solved.after, step.h, step.fall(),
                            step.last > 0 && last_kick > 0 ? step.kick() / last_kick : 0};
  const std::size_t first = problem.rows() - posed.rows.jacobian.size();
  const Islands& graph = problem.graph.islands;
  std::vector<Island>& islands = solved.islands.each;
  islands.resize(graph.count);
  for (Island& i : islands) i.jumps = false;
  for (std::size_t k = 0; k < graph.of_block.size(); ++k) {
    Island& island = islands[graph.of_block[k]];
    if (island.jumps) continue;
    const std::size_t row = static_cast<std::size_t>(problem.graph.first_row[k]);
    const double x = solved.solution.x[row];
    // Rows of joints come last. A block may have several rows; the first is that along which it pulls.
    island.jumps =
        row < first ? is_rough(motion, o.contacts[k], x) : is_rough(motion, posed.rows, row - first, x);
  }
  visited.each(ahead.size(), [&](std::size_t i) {
    if (const Index home = graph.of_body[i]; (home >= 0 && islands[home].jumps) || o.stopped[i]) ahead[i] = 0;
  });
}

}  // namespace amontons
