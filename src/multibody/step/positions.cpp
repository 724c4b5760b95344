// docs/algorithm.md (26): the smallest displacement p of the bodies that removes position errors, 1/2 p' M p
// -> min. Equalities are C + D p = 0, inequalities C + D p >= 0. These include the gaps of all contacts, so
// that a body pushed out of one neighbour is not pushed into the next. The optimality conditions are a VI of
// the form of the step's. Frictionless impulses are the multipliers and p / h the velocities (Acary,
// "Projected event-capturing time-stepping schemes for nonsmooth mechanical systems with unilateral contact
// and Coulomb's friction", CMAME 256, 2013).
//
// Inequalities are soft by three digits of D M^-1 D': if joints contradict contacts or limits, joints prevail
// and the remaining error is shared. Errors that can be removed are removed to that softness; the next step
// treats the rest.
#include "multibody/step/positions.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/policy.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/fixed_contacts.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/solve_step.hpp"
#include "multibody/trees/rates.hpp"

namespace amontons {

namespace {

struct PositionInput {
  const StepSetting& step;
  const Observed& observed;
  const BodyMobilities& mobility;
  const State& state;
  const Model& model = step.model;
  const BodyFrames& frames = observed.frames;
  const std::vector<Contact>& contacts = observed.contacts;
  const double h = step.h, length = model.length();
  StepBodies at_rest(const BodyVelocities& rest) const {
    return {frames, mobility, rest, rest, observed.trees.constrained};
  }
};

bool is_rigid(const Contact& c) { return c.material.compliance == 0; }

// Whether a body cannot move along the normal of a contact, because its joint to the world or to a fixed body
// has no dof in that direction. An example is a slider modelled inside its table.
bool is_held(const PositionInput& in, Index body, const Contact& c) {
  if (!in.model.is_dynamic(body)) return true;
  return std::any_of(in.observed.joints.begin(), in.observed.joints.end(), [&](const JointContext& joint) {
    const Index other = joint.body_a == body ? joint.body_b : joint.body_a;
    if ((joint.body_a != body && joint.body_b != body) || in.model.is_dynamic(other)) return false;
    if (joint.joint->compliance > 0 || !is_chain(*joint.joint) || joint.chain.spherical) return false;
    const Vec3 reference = joint.body_a >= 0 ? in.frames[joint.body_a].centre + joint.r_a
                                             : in.frames[joint.body_b].centre + joint.r_b;
    const Mat3 to_joint = transposed(joint.axes);
    const Screw push{to_joint * c.normal, to_joint * cross(c.point - reference, c.normal)};
    for (std::size_t i = 0; i < joint.chain.dofs; ++i)
      if (std::abs(dot(push, joint.chain.screws[i])) > base::policy.rounding * joint.scale(i)) return false;
    return true;
  });
}

// Whether moving bodies can remove the overlap of a contact.
bool can_open(const PositionInput& in, const Contact& c) {
  return !(is_held(in, c.body_a, c) && is_held(in, c.body_b, c));
}

// By how much the dofs of a joint are beyond their limits (m); angles count times length.
double travel_error(const PositionInput& in, Index joint) {
  const auto& dofs = in.model.joint(joint).dofs;
  double worst = 0;
  for (std::size_t i = 0; i < dofs.size(); ++i) {
    const double q = in.state.coordinates[in.model.first_dof(static_cast<std::size_t>(joint)) + i];
    const double s = dofs[i].kind == Dof::Kind::hinge ? in.length : 1;
    worst = std::max({worst, s * (q - dofs[i].upper), s * (dofs[i].lower - q)});
  }
  return worst;
}

// The largest error (m); angles count times length.
double largest_error(const PositionInput& in) {
  double worst = 0;
  for (const Contact& c : in.contacts)
    if (is_rigid(c) && -c.gap > std::max(worst, allowed_error(in.length)) && can_open(in, c)) worst = -c.gap;
  worst = std::max({worst, in.observed.errors.joint.distance, in.length * in.observed.errors.joint.angle,
                    in.observed.errors.line});
  for (std::size_t j = 0; j < in.model.joints(); ++j)
    worst = std::max(worst, travel_error(in, static_cast<Index>(j)));
  return worst;
}

// D M^-1 D' of a row that may have an auxiliary body: six numbers with one mass.
double effective_inverse_mass(const JacobianRow& row, const BodyMobilities& mobility,
                              const std::vector<double>& auxiliary) {
  double w = 0;
  const auto add = [&](Index body, const std::array<double, 6>& j) {
    if (body < 0) return;
    const auto i = static_cast<std::size_t>(body);
    if (i < mobility.size())
      w += side_inverse_mass(j, mobility[i]);
    else
      for (double c : j) w += auxiliary[i - mobility.size()] * c * c;
  };
  add(row.body_a, row.a);
  add(row.body_b, row.b);
  return w;
}

// The normal of a contact as a row.
JacobianRow normal_row(const Contact& c) {
  const auto wrench = [](const Vec3& n, const Vec3& r) {
    const Vec3 t = cross(r, n);
    return std::array<double, 6>{n.x, n.y, n.z, t.x, t.y, t.z};
  };
  JacobianRow row{c.body_a, c.body_b, wrench(c.normal, c.r_a), {}};
  if (c.body_b >= 0) row.b = wrench(-c.normal, c.r_b);
  return row;
}

// Rows of the joints that constrain positions, then the contacts. Springs and servos have E = 1 / (h^2 k +
// ...) as in the step: a robot that can be lifted is lifted and not bent. Large models omit them, because a
// first-order method would not converge with them. `speed`: target of inequalities.
void position_rows(const PositionInput& in, const BodyVelocities& rest, double speed,
                   PositionMemory& memory) {
  auto& [all, rows, _1, _2, _3, _4] = memory;
  all.clear();
  rows.clear();
  JointOptions options = in.step.joint_options();
  options.dampers = false;
  append_joint_rows(in.model, in.at_rest(rest), in.observed.joints, in.state, options, all);
  rows.auxiliary_inverse_mass = all.auxiliary_inverse_mass;
  const double h = in.h;
  const bool few = all.tags.size() <= step::policy.few_rows;
  const auto of_model = [&](Index body) {  // auxiliary bodies follow those of the model
    return body < static_cast<Index>(in.model.bodies()) ? body : world;
  };
  const auto append_inequality = [&](const JacobianRow& row, double gap, const RowTag& tag) {
    const double E = base::policy.three_digits *
                     in.model.lightness(of_model(row.body_a), of_model(row.body_b)) *
                     effective_inverse_mass(row, in.mobility, rows.auxiliary_inverse_mass);
    rows.append(NonNegative{}, row, {E, std::max(gap / h, -speed)}, 0, tag);
  };
  for (std::size_t i = 0; i < all.tags.size(); ++i) {
    const double C = all.position[i];
    const Restraint restraint = all.restraint[i];
    if (restraint == Restraint::inequality)
      append_inequality(all.jacobian[i], C, all.tags[i]);
    else if (restraint == Restraint::none && all.compliance[i] > 0 && few)
      rows.append(Bilateral{}, all.jacobian[i], {all.compliance[i], 0}, 0, all.tags[i]);
    else if (restraint != Restraint::none)  // for locked rows C = 0
      rows.append(Bilateral{}, all.jacobian[i],
                  {all.compliance[i], std::clamp(C / h, -in.step.displacing, in.step.displacing)}, 0,
                  all.tags[i]);
  }
  for (const Contact& c : in.contacts)
    if (is_rigid(c)) append_inequality(normal_row(c), c.gap, {RowKind::limit, -1, -1});
}

// Per body: it moves, or has an error above the allowed one. A body asleep has neither: an island with an
// error is corrected in the step in which it would rest, which changes its part of the state.
std::vector<unsigned char> find_correctable(const PositionInput& in) {
  const double allowed = allowed_error(in.length);
  std::vector<unsigned char> found;
  for (const BodyVelocity& v : in.observed.start)
    found.push_back(!(v.linear == Vec3{} && v.angular == Vec3{}));
  const auto mark = [&](Index a, Index b) {
    for (const Index body : {a, b})
      if (body >= 0) found[static_cast<std::size_t>(body)] = 1;
  };
  for (const Contact& c : in.contacts)
    if (is_rigid(c) && -c.gap > allowed && can_open(in, c)) mark(c.body_a, c.body_b);
  for (const JointContext& joint : in.observed.joints) {
    const JointError error = joint_error(in.model, {&joint, 1});
    if (std::max({error.distance, in.length * error.angle, travel_error(in, joint.index)}) > allowed)
      mark(joint.body_a, joint.body_b);
  }
  return found;
}

// The blocks of all islands but those that stand and have no error: the latter stay where they are, to the
// bit, whatever happens elsewhere. They could not sleep otherwise (sleep.cpp).
//
// Islands that move are corrected even if their own errors are below the allowed one. The end of an overlap
// lifts the bodies above it. If overlaps grew until one exceeds the allowed error, a wall would rise by all
// of them at once. It would gain 1e-4 of the energy of the ball that hits it (test_small_wall_under_impact).
//
// Each row is a block.
void find_blocks(const PositionInput& in, const JointRows& rows, const Islands& graph,
                 std::vector<std::size_t>& blocks) {
  static thread_local std::vector<unsigned char> corrected;
  corrected.assign(graph.count, 0);
  const std::vector<unsigned char> bodies = find_correctable(in);
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (bodies[i] && graph.of_body[i] >= 0) corrected[graph.of_body[i]] = 1;
  const auto is_line = [&](std::size_t k) {
    const RowKind kind = rows.tags[k].kind;
    return kind == RowKind::coupling || kind == RowKind::tendon || kind == RowKind::rub ||
           kind == RowKind::clearance;
  };
  for (std::size_t k = 0; k < rows.tags.size() && in.observed.errors.line > allowed_error(in.length); ++k)
    if (is_line(k)) corrected[graph.of_block[k]] = 1;
  blocks.clear();
  for (std::size_t k = 0; k < graph.of_block.size(); ++k)
    if (corrected[graph.of_block[k]]) blocks.push_back(k);
}

// The displacements, as velocities over h. Empty if no body can remove an error, or if the time of `budget`
// runs out before they are better than none: the next step tries again.
BodyVelocities displacements(const PositionInput& in, const BodyVelocities& rest, StepClock& clock,
                             Budget& budget, PositionMemory& memory, StepSums& sums) {
  auto& [_1, rows, whole, part, number, elimination] = memory;
  std::vector<Contact> none;
  const Assembly at_rest{.h = in.h, .kick = in.h, .recovery_speed = 0};
  assemble_system(in.at_rest(rest), none, rows, at_rest, whole);
  write_b(rest, none, rows, at_rest, {}, whole);
  find_blocks(in, rows, whole.graph.islands, part.blocks);
  if (part.blocks.empty()) return {};
  part.make(whole, {}, number);
  const Problem& problem = part.of.problem;
  clock.lap(&Timings::assembly);
  const bool linear = problem.K.all_bilateral();
  Options options;
  options.law = Law::associated;
  options.tolerance = step::policy.allowed_error;
  options.max_iterations = step::policy.most_repeats;
  Budget share = budget.part_of_work(step::policy.share_of_part);
  const bool few = linear || problem.rows() <= step::policy.few_rows;
  if (!few) options.iterates = in.step.options.iterates;  // a device that serves large steps serves this, too
  const Solution s = few ? automatic(problem, options, share, elimination) : apgd(problem, options, share);
  // Products of this solve are in the report, and so is its time.
  clock.lap(&Timings::solve);
  ++sums.solves;
  sums.add_cost(s);
  if (s.status == Status::deadline && s.residual >= 1) return {};
  std::vector<double> x(whole.rows(), 0.0);
  part.of.put(s.x, x);
  BodyVelocities p = rest;
  apply_impulses(whole, x, p);
  return p;
}

// The fastest angular velocity (rad/s).
double turning(const BodyVelocities& p) {
  double fastest = 0;
  for (const BodyVelocity& body : p) fastest = std::max(fastest, norm(body.angular));
  return fastest;
}

// Neighbours must not push a body into fixed geometry, even if the problem was solved roughly.
void stop_at_fixed(const PositionInput& in, BodyVelocities& p) {
  const double error = allowed_error(in.length);
  std::vector<double> least;
  for (const Contact& c : in.contacts) least.push_back(-(std::max(c.gap, 0.0) + error) / in.h);
  stop_at_fixed({in.model, in.mobility, in.contacts, least, in.h}, p);
}

}  // namespace

// Smaller errors stay, so that resting bodies do not move.
double allowed_error(double length) { return step::policy.allowed_error * length; }

static bool correct_positions(const StepSetting& step, StepClock& clock, StepScratch& scratch, State& state,
                              StepSums& sums) {
  Observed& observed = scratch.observed;
  PositionMemory& memory = scratch.positions;
  const PositionInput in{step, observed, scratch.stiffened.mobility, state};
  const double error = largest_error(in), h = in.h;
  if (!(error > allowed_error(in.length))) return false;
  const BodyVelocities rest(in.frames.size());
  position_rows(in, rest, in.step.displacing, memory);
  if (memory.rows.tags.empty()) return false;
  Budget time = clock.budget.part_of_time(step::policy.share_of_part);
  BodyVelocities p = displacements(in, rest, clock, time, memory, sums);
  if (p.empty()) return false;
  // A displacement is linear in p. A body that turns by t about its joint departs from it by t^2 / 2 of its
  // arm, of which three digits may be lost. If bodies would turn by more, inequalities demand only a part.
  const double largest_turn = std::sqrt(base::policy.three_digits);
  if (const double turn = h * turning(p); turn > largest_turn) {
    const double share = largest_turn / turn;
    position_rows(in, rest, share * std::min(in.step.displacing, error / h), memory);
    p = displacements(in, rest, clock, time, memory, sums);
    if (p.empty()) return false;
    // Rows of joints demand their whole error even so. The next steps remove what a shorter way leaves.
    if (const double part = largest_turn / (h * turning(p)); part < 1)
      for (BodyVelocity& body : p) body = {part * body.linear, part * body.angular};
  }
  stop_at_fixed(in, p);
  for (std::size_t i = 0; i < p.size(); ++i) {
    const bool stays = p[i].linear == Vec3{} && p[i].angular == Vec3{};
    if (!in.model.is_dynamic(static_cast<Index>(i)) || step.tree.moves(i) || stays ||
        !is_finite(p[i].linear) || !is_finite(p[i].angular))
      continue;
    const Quat turn = exponential(h * p[i].angular);
    const Vec3 arm = in.frames[i].centre - state.positions[i];
    MiddleVelocity& middle = state.middle_velocities[i];
    const Vec3 omega = middle.angular;
    const Vec3 velocity = middle.linear + cross(omega, arm);
    // The angular momentum of the body is kept while its inertia turns, unless that would create energy.
    const Vec3 momentum = rotate(conjugate(turn), in.frames[i].inertia * omega);
    const Vec3 spin = inverse(in.frames[i].inertia) * momentum;
    const double had = dot(omega, in.frames[i].inertia * omega), has = dot(spin, momentum);
    const Transform to = moved(in.frames[i], p[i], h);
    state.positions[i] = to.position;
    state.orientations[i] = normalised(to.rotation);
    middle.angular = rotate(turn, has > had ? std::sqrt(had / has) * spin : spin);
    middle.linear = velocity - cross(middle.angular, rotate(turn, arm));
  }
  // Trees follow the displacements as far as their joints let them, and keep the rates of their joints.
  if (!step.tree.moves()) return true;
  TreeStep& trees = observed.trees;
  read_rates(step.tree, trees, in.frames, p, trees.after);
  read_rates(step.tree, trees, in.frames, observed.start, trees.before);
  move_trees(observed.tree_setting(step), p, trees.after, trees.before, trees, state);
  return true;
}

bool correct(const StepSetting& step, StepClock& clock, StepScratch& scratch, State& state, StepSums& sums) {
  Observed& o = scratch.observed;
  stiffen(step, state, o, scratch.stiffened);
  if (step.options.recovery != Recovery::projection || clock.short_of_time ||
      !correct_positions(step, clock, scratch, state, sums))
    return false;
  clock.lap(&Timings::assembly);
  observe(step, clock, state, o);
  stiffen(step, state, o, scratch.stiffened);
  return true;
}

}  // namespace amontons
