// Restitution by generalised reflections (Smith, Kaufman, Vouga, Tamstorf, Grinspun, SIGGRAPH 2012). All
// approaching contacts are reflected together, then those that approach next, until none approaches. Contacts
// that do not approach are left out, so that momentum passes through a row of balls instead of stopping in
// it. docs/algorithm.md (27). Energy does not grow in any reflection: see limit_energy.
#include "multibody/step/impacts.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/multibody/joints/joints.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/trees/masses.hpp"
#include "multibody/trees/reactions.hpp"

namespace amontons {

namespace {

// Impacts are over before springs, motors, dry friction or stabilisation act. So only locked directions get
// rows, which keep their velocities (c = 0). Limits, and flanks of couplings,
// are left to the step that follows.
JointRows locked_rows(const StepSetting& step, const State& state, const Observed& o,
                      const StepBodies& bodies) {
  JointRows all, locked;
  append_joint_rows(step.model, bodies, o.joints, state, step.joint_options(), all);
  locked.auxiliary_inverse_mass = all.auxiliary_inverse_mass;
  for (std::size_t i = 0; i < all.tags.size(); ++i)
    if (all.tags[i].kind == RowKind::locked ||
        (all.tags[i].kind == RowKind::coupling && all.restraint[i] != Restraint::inequality))
      locked.append(Bilateral{}, all.jacobian[i], {all.compliance[i], 0}, 0, all.tags[i]);
  return locked;
}

// Newton's u_n^+ = -e u_n^- with friction may create energy if friction reverses the slip of an eccentric
// impact (Kane and Levinson, Dynamics, 1985; Stronge, Proc. R. Soc. A 431, 1990). The impact without
// restitution never does: with x0 complementary to u0^+ its work is at most -x0' A x0 / 2. So if s did
// positive work, the impulses move back towards x0 until the work is zero. Cone and joint conditions are
// convex and stay satisfied, and so does u_n^+ >= 0.
//
// Bodies move with u- along the rows before the impact. The work of impulses x is x' (u- + A x / 2), the mean
// of the velocities before and after; A x is the solution's u minus its b. As b_n = (1 + e) u_n^-, the
// problem without restitution has b = u-.
void limit_energy(const Problem& problem, std::span<const Contact> contacts, const StepSolver& solver,
                  Solution& s) {
  Problem inelastic = problem;
  for (std::size_t i = 0; i < contacts.size(); ++i)  // all of these contacts approach
    inelastic.b[problem.graph.first_row[i]] /= 1 + contacts[i].material.restitution;
  const std::vector<double>& before = inelastic.b;
  const auto sum = [&](const auto& term) {
    double total = 0;
    for (std::size_t i = 0; i < s.x.size(); ++i) total += term(i);
    return total;
  };
  const auto Ax = [&](std::size_t i) { return s.u[i] - problem.b[i]; };
  const double stored = sum([&](std::size_t i) { return 0.5 * s.x[i] * Ax(i); });
  const double work = sum([&](std::size_t i) { return s.x[i] * (before[i] + 0.5 * Ax(i)); });
  if (work <= solver.simulation.tolerance * stored) return;
  const Solution plastic = solve_step(solver, inelastic, {});
  solver.sums.add_status(plastic.status);
  // The work at x0 + share d, d = x - x0, is a + b share + c share^2 with a <= 0 <= c. The larger root is the
  // share of s that may stay, in the form without cancellation for b > 0.
  const auto Ax0 = [&](std::size_t i) { return plastic.u[i] - before[i]; };
  const auto d = [&](std::size_t i) { return s.x[i] - plastic.x[i]; };
  const double a =
      std::min(sum([&](std::size_t i) { return plastic.x[i] * (before[i] + 0.5 * Ax0(i)); }), 0.0);
  const double b = sum([&](std::size_t i) { return d(i) * (before[i] + Ax0(i)); });
  const double c = sum([&](std::size_t i) { return 0.5 * d(i) * (Ax(i) - Ax0(i)); });
  const double root = std::sqrt(b * b - 4 * a * c);
  const double share = b > 0 ? -2 * a / (b + root) : c > 0 ? (root - b) / (2 * c) : 0;
  for (std::size_t i = 0; i < s.x.size(); ++i)
    s.x[i] = plastic.x[i] + std::clamp(share, 0.0, 1.0) * (s.x[i] - plastic.x[i]);
}

// Collects the contacts that approach faster than the threshold and close within the step. An open contact
// takes part if gap + h u_n <= 0: it strikes within the step, and the next step would reflect it in a later
// pose. Returns whether any of them has restitution.
bool approaching(const std::vector<Contact>& contacts, const BodyVelocities& v, double threshold, double h,
                 std::vector<std::size_t>& index) {
  index.clear();
  bool elastic = false;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const double u = dot(contacts[i].normal, relative_motion(contacts[i], v).linear);
    if (u >= -threshold || contacts[i].gap + h * u > 0) continue;
    index.push_back(i);
    elastic = elastic || contacts[i].material.restitution > 0;
  }
  return elastic;
}

// Adds impulses of the active contacts to the contacts that they copy, and those of locked directions to
// their joints as wrenches. Couplings are left out: their impulses are reported per step, by the rows of the
// step.
void store(const Problem& problem, const std::vector<double>& x, const std::vector<std::size_t>& index,
           const JointRows& locked, std::vector<Contact>& contacts, std::vector<JointWrench>& joints) {
  for (std::size_t k = 0; k < index.size(); ++k) {
    Contact& c = contacts[index[k]];
    // Only the active copy has the length of its moments.
    const ContactGeometry& active = std::get<ContactSystem>(problem.A).contacts[k];
    const ContactImpulse impulse = to_world(active, &x[problem.graph.first_row[k]]);
    c.impulse += impulse.linear;
    c.angular_impulse += impulse.angular;
  }
  const std::size_t first = problem.rows() - locked.tags.size();
  for (std::size_t i = 0; i < locked.tags.size(); ++i) {
    const RowTag& tag = locked.tags[i];
    if (tag.kind != RowKind::locked) continue;
    joints[tag.joint].force += x[first + i] * tag.force;
    joints[tag.joint].torque += x[first + i] * tag.torque;
  }
}

}  // namespace

static bool reflect(const StepSetting& step, const StepSolver& solver, const State& state, Observed& o) {
  const double h = step.h;
  BodyVelocities& v = o.start;
  JointRows locked;
  std::vector<Contact> active;
  std::vector<std::size_t> index;
  StepBodies bodies{o.frames, o.mobility, v, v};
  for (std::size_t reflection = 0; reflection < step::policy.most_repeats; ++reflection) {
    const bool elastic = approaching(o.contacts, v, step.restitution, h, index);
    // Without restitution there is nothing to reflect: the step stops approaching bodies.
    if (index.empty() || (reflection == 0 && !elastic)) return reflection > 0;
    // If time runs out or the solve fails, the step also stops the remaining approaching bodies.
    const bool missed = solver.sums.status != Status::converged;
    if (solver.budget.ends_within(solver.clock.search) || (reflection > 0 && missed)) return reflection > 0;
    // Springs and dampers do not act within an impact: M of trees without them.
    if (reflection == 0 && step.tree.moves())
      bodies.trees = tree_masses(o.tree_setting(step), false, o.trees);
    if (reflection == 0) locked = locked_rows(step, state, o, bodies);
    active.clear();
    for (std::size_t i : index) active.push_back(o.contacts[i]);
    const Problem problem =
        assemble(bodies, active, locked,
                 {.h = h, .kick = step.kick(), .recovery_speed = 0, .impact = true, .model = &step.model});
    solver.clock.lap(&Timings::assembly);
    Solution s = solve_step(solver, problem, {});
    solver.sums.add_status(s.status);
    limit_energy(problem, active, solver, s);
    solver.clock.lap(&Timings::solve);
    if (step.tree.moves())
      add_tree_impacts(o.tree_setting(step), o.joints, impulses_on_bodies(problem, s.x), *bodies.trees,
                       o.trees, o.impacts);
    apply_impulses(problem, s.x, v);
    store(problem, s.x, index, locked, o.contacts, o.impacts);
  }
  return true;
}

// Impacts act on the velocities in the poses of the start, half a kick of loads after those in the middle of
// the last step. So a ball that is reflected keeps its energy, wherever in the step it touches.
bool resolve_impacts(const StepSetting& step, const StepSolver& solver, const State& state, Observed& o) {
  o.impacts.assign(step.model.joints(), JointWrench{});
  const double share = step.last / (2 * step.kick());
  static thread_local BodyVelocities middle, ahead;
  const Subset& visited = step.visited.bodies;
  middle.resize(o.start.size());
  ahead.resize(o.start.size());
  visited.each(middle.size(), [&](std::size_t i) {
    middle[i] = o.start[i];
    ahead[i] = {};
    if (!step.model.is_dynamic(static_cast<Index>(i))) return;
    ahead[i] = {share * (o.free[i].linear - middle[i].linear), share * (o.free[i].angular - o.spins[i].mean)};
    o.start[i].linear += ahead[i].linear;
    o.start[i].angular += ahead[i].angular;
  });
  const bool bounced = reflect(step, solver, state, o);
  visited.each(middle.size(), [&](std::size_t i) {
    if (!bounced) o.start[i] = middle[i];
    if (!bounced) return;
    o.start[i].linear -= ahead[i].linear;
    o.start[i].angular -= ahead[i].angular;
  });
  return bounced;
}

}  // namespace amontons
