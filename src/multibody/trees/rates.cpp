// Free rates balance the momenta of two displacements, the one that led here and the next one. Nothing here
// differentiates M: its velocity terms are the differences of these momenta, docs/algorithm.md (39).
#include "multibody/trees/rates.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/policy.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/trees/momenta.hpp"
#include "multibody/trees/poses.hpp"

namespace amontons {

namespace {

// Each round gains a factor h |q'|, 0.02 for 10 rad/s at 2 ms.
constexpr int most_rounds = 8;  // not tuned: with twice as many no run of benchmarks/sensitivity.py changes

// Forces along a coordinate that are linear in its rate act implicitly, as those of rows (drive_terms).
//
// The impulse along a coordinate of its spring, damper and inertia if it ends with a rate.
double drive_impulse(const TreeSetting& in, const TreeStep& trees, std::size_t k, double rate) {
  const TreeDrive& d = trees.drives[k];
  const DriveShares s = drive_shares(in.h, in.last, d.euler);
  const double before = trees.before[k];
  return -in.kick() * (d.stiffness * (d.stretch + s.stretch_after * rate + s.stretch_before * before) +
                       d.damping * (s.rate_after * rate + s.rate_before * before)) -
         d.inertia * (rate - before);
}

// Velocities of bodies from rates; in.memory.flow are the flows.
void write_velocities(const TreeSetting& in, const BodyFrames& frames, std::span<const double> rates,
                      const TreeStep& trees, BodyVelocities& v) {
  const Tree& tree = in.tree;
  make_flows(in, frames, v, rates, trees);
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const Flow& f = in.memory.flow[i];
    const TreePlace& place = trees.places[i];
    v[tree.moving()[i].body] = {f.linear + cross(f.angular, place.centre - place.reference), f.angular};
  }
}

// Impulses along the coordinates of impulses on the bodies, which are summed along the trees: J' by the
// columns. Bodies come after their parents, so that one pass from the last to the first suffices.
void project(const TreeSetting& in, std::vector<Flow>& impulses, const TreeStep& trees) {
  const Tree& tree = in.tree;
  for (std::size_t i = tree.moving().size(); i-- > 0;) {
    const TreeBody& b = tree.moving()[i];
    for (std::size_t k = b.first; k < b.first + b.count; ++k)
      in.memory.along[k] = power(impulses[i], trees.columns[k]);
    if (b.above >= 0) impulses[b.above] += impulses[i];
  }
}

}  // namespace

// Parents and bodies as they move, relative to each other: an error of one joint does not reach the next one.
// The rest of the spin after the dofs of a ball is that of the ball.
void read_rates(const Tree& tree, const TreeStep& trees, const BodyFrames& frames, const BodyVelocities& v,
                std::vector<double>& rates) {
  rates.resize(tree.parent().size());
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    if (b.joint < 0) {
      const BodyVelocity& base = v[b.body];
      const double values[6] = {base.linear.x,  base.linear.y,  base.linear.z,
                                base.angular.x, base.angular.y, base.angular.z};
      std::copy_n(values, 6, rates.begin() + static_cast<std::ptrdiff_t>(b.first));
      continue;
    }
    const Vec3& reference = trees.places[i].reference;
    Flow twist = flow_of(frames, v, b.body, reference) - flow_of(frames, v, b.parent, reference);
    for (std::size_t k = b.first; k < b.first + b.dofs; ++k) rates[k] = power(trees.duals[k], twist);
    if (b.count == b.dofs) continue;
    for (std::size_t k = b.first; k < b.first + b.dofs; ++k)
      twist.angular -= rates[k] * trees.columns[k].angular;
    for (std::size_t k = b.first + b.dofs; k < b.first + b.count; ++k)
      rates[k] = dot(trees.columns[k].angular, twist.angular);
  }
}

namespace {

// Precision of rates (relative to the fastest): rounding, and three digits that the solve with M may lose.
// The rounds of find_rates() end if the next one would change rates by less.
double rate_precision() { return base::policy.rounding / base::policy.three_digits; }

// The displacement of a step differs from that of its start velocities by the square of the angle, and so do
// momenta. Below the precision of rates it need not be known.
bool is_slow(double angle) { return angle * angle < rate_precision(); }
bool is_fast(double angle) { return angle * angle > base::policy.three_digits; }

double largest(std::span<const double> rates) {
  double most = 0;
  for (const double rate : rates) most = std::max(most, std::abs(rate));
  return most;
}

// The change of each body's momentum, from the displacement before the step to the one after it, is the
// impulse of loads and joints. Those of joints do no work along the columns, which leaves one equation per
// coordinate. This is the discrete form of d'Alembert's principle (Marsden, West, Acta Numerica 10, 2001): of
// second order, and the momentum of a free tree is constant. M is its derivative up to a share h |q'|, by
// which each round of Newton's method reduces the error. `in.memory.pushed`: impulses along the coordinates.
//
// False: the rounds diverge, as coordinates turn too far within the step.
bool find_rates(const TreeSetting& in, TreeStep& trees, std::vector<double>& rates) {
  const Tree& tree = in.tree;
  const std::size_t n = tree.parent().size();
  in.memory.along.resize(n);
  const double fastest = std::max(trees.fastest, largest(rates));
  double last = INFINITY;
  for (int round = 0; round < most_rounds; ++round) {
    // The residual: the momenta before the step and all impulses, less the momenta after it.
    make_momenta(in, rates, in.h, trees, in.memory.impulse);
    for (std::size_t i = 0; i < tree.moving().size(); ++i)
      in.memory.impulse[i] = trees.supply[i] - in.memory.impulse[i];
    subtract_stiffness(in, rates, trees, in.memory.impulse);
    project(in, in.memory.impulse, trees);
    for (std::size_t k = 0; k < n; ++k)
      in.memory.along[k] += drive_impulse(in, trees, k, rates[k]) + in.memory.pushed[k];
    trees.constrained->linkage->solve(in.memory.along.data());
    for (std::size_t k = 0; k < n; ++k) rates[k] += in.memory.along[k];
    const double change = largest(in.memory.along);
    if (change <= rate_precision() * fastest) return true;
    // At rounding changes no longer fall.
    if (!(change < last)) return change <= base::policy.three_digits * fastest;
    // Changes fall by a factor per round, so that the next one is known: change^2 / last.
    if (round > 0 && change * change <= rate_precision() * fastest * last) return true;
    last = change;
  }
  return last <= base::policy.three_digits * fastest;
}

}  // namespace

// Impulses of loads on each body over the kick, about the reference. The momenta before the step are added to
// them when the impulses of rows are foreseen, so that the search for contacts does without.
static void supply_loads(const TreeSetting& in, const std::vector<BodyImpulse>& loads, TreeStep& trees) {
  const Model& model = in.model;
  const Tree& tree = in.tree;
  const double kick = in.kick();
  trees.supply.resize(tree.moving().size());
  const Vec3& gravity = model.description().gravity;
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const Index body = tree.moving()[i].body;
    const Vec3 weight = model.body(body).mass * model.body(body).gravity_scale * gravity;
    const Vec3 push = kick * weight + loads[body].force;
    const Vec3& turn = loads[body].torque;
    trees.supply[i] = {push, turn + cross(trees.places[i].centre - trees.places[i].reference, push)};
  }
}

// The velocity terms of the equations of motion by the recursive Newton-Euler equations (Featherstone 2008,
// ch. 5.3). An axis moves with the body that carries it. With the flow v before a column s it changes by v x
// s. At constant rates that is the acceleration q' v x s of the bodies beyond it. The force on a body is the
// change of its momentum,
//
//   f = I a + v x* (I v),   v x* (p, L) = (omega x p, omega x L + v_O x p).
//
// A centre of mass without a joint moves straight, so that its flow at the reference changes by -omega x v.
//
// in.memory.impulse: minus those that the bodies need over the kick to keep their rates.
static void subtract_velocity_terms(const TreeSetting& in, TreeStep& trees) {
  const Tree& tree = in.tree;
  in.memory.impulse.resize(tree.moving().size());
  const auto straight = [&](Index body) {
    return body < 0 ? Flow{} : Flow{-cross(in.start[body].angular, in.start[body].linear), {}};
  };
  in.memory.flow.resize(tree.moving().size());
  in.memory.bias.resize(tree.moving().size());
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    const Vec3& reference = trees.places[i].reference;
    Flow v = b.above >= 0 ? in.memory.flow[b.above] : flow_of(in.frames, in.start, b.parent, reference);
    Flow a = b.above >= 0 ? in.memory.bias[b.above] : straight(b.parent);
    if (b.joint < 0) {
      v = flow_of(in.frames, in.start, b.body, reference);
      a = straight(b.body);
    }
    for (std::size_t c = 0; b.joint >= 0 && c < b.count; ++c) {
      // From the parent to the body: the first dof is next to body B of the joint.
      const std::size_t k = b.first + (b.reversed ? b.count - 1 - c : c);
      const Flow s = trees.before[k] * trees.columns[k];
      a += carried(v, s);
      v += s;
    }
    in.memory.flow[i] = v;
    in.memory.bias[i] = a;
    const Flow p = momentum_of(trees.inertias[i], v), needed = momentum_of(trees.inertias[i], a);
    const Flow change{needed.linear + cross(v.angular, p.linear),
                      needed.angular + cross(v.angular, p.angular) + cross(v.linear, p.linear)};
    in.memory.impulse[i] = (-in.kick()) * change;
  }
}

// Velocity terms move energy between coordinates. Explicit ones create energy if these turn by radians within
// a step. Their share s is the largest at which the energy of the rates does not rise in this pose:
//
//   E(s) = s <q', p> + s^2 / 2 <d, p> <= 0,   p = -K c(q, q'),   d = M^-1 p.
static void limit_velocity_terms(const TreeSetting& in, TreeStep& trees) {
  const Tree& tree = in.tree;
  const std::size_t n = tree.parent().size();
  subtract_velocity_terms(in, trees);
  project(in, in.memory.impulse, trees);
  std::vector<double>& change = in.memory.mean;
  change = in.memory.along;
  trees.constrained->linkage->solve(change.data());
  double along = 0, square = 0;
  for (std::size_t k = 0; k < n; ++k) {
    along += trees.before[k] * in.memory.along[k];
    square += change[k] * in.memory.along[k];
  }
  const double share = along < 0 ? std::min(1.0, -2 * along / square) : 0.0;
  for (std::size_t k = 0; k < n; ++k) trees.free[k] -= (1 - share) * change[k];
}

// One round with the velocity terms at the start of the step is of first order, which is enough to search for
// contacts. It costs a third of a round with momenta over displacements.
void make_free_tree_velocities(const TreeSetting& in, const std::vector<BodyImpulse>& loads, TreeStep& trees,
                               BodyVelocities& free) {
  const Tree& tree = in.tree;
  read_rates(tree, trees, in.frames, in.start, trees.before);
  supply_loads(in, loads, trees);
  const std::size_t n = tree.parent().size();
  in.memory.along.resize(n);
  subtract_velocity_terms(in, trees);
  for (std::size_t i = 0; i < tree.moving().size(); ++i) in.memory.impulse[i] += trees.supply[i];
  trees.slow_supply = in.memory.impulse;
  project(in, in.memory.impulse, trees);
  for (std::size_t k = 0; k < n; ++k) in.memory.along[k] += drive_impulse(in, trees, k, trees.before[k]);
  trees.constrained->linkage->solve(in.memory.along.data());
  trees.free = trees.before;
  for (std::size_t k = 0; k < n; ++k) trees.free[k] += in.memory.along[k];
  trees.fastest = largest(trees.before);
  if (is_fast(in.h * trees.fastest)) limit_velocity_terms(in, trees);
  write_velocities(in, in.frames, trees.free, trees, free);
}

// Joints do no work over two displacements in mean, if these are short: their forces are normal to the
// motion in the pose between them. Coordinates that turn by radians within a step break this.
static bool creates_energy(const TreeSetting& in, TreeStep& trees) {
  const Tree& tree = in.tree;
  const double fastest = std::max(trees.fastest, largest(trees.free));
  if (!is_fast(in.h * fastest)) return false;
  make_momenta(in, trees.free, in.h, trees, in.memory.impulse);
  double energy = 0, work = 0;
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    energy += power(in.memory.momenta[i], in.memory.chord_before[i]) +
              power(in.memory.impulse[i], in.memory.chord[i]);
    in.memory.impulse[i] = in.memory.impulse[i] - trees.supply[i];
  }
  for (std::size_t i = 0; i < tree.moving().size(); ++i)
    work += power(in.memory.impulse[i], in.memory.chord[i]) +
            power(in.memory.impulse[i], in.memory.chord_before[i]);
  for (std::size_t k = 0; k < trees.free.size(); ++k)
    work -= (drive_impulse(in, trees, k, trees.free[k]) + in.memory.pushed[k]) *
            (trees.free[k] + trees.before[k]);
  return !(work <= base::policy.three_digits * energy);
}

// A damped step of first order: the momenta before it, projected on the rates. That takes energy from bodies
// whose coordinates turn by radians. But where links unfold, a displacement is longer than its tangent. Rates
// are scaled down until the displacement has no more energy than the one before it, plus the work of loads.
static void project_momenta(const TreeSetting& in, TreeStep& trees) {
  const Tree& tree = in.tree;
  const std::size_t n = tree.parent().size();
  in.memory.impulse = trees.supply;
  project(in, in.memory.impulse, trees);
  for (std::size_t k = 0; k < n; ++k) in.memory.along[k] += drive_impulse(in, trees, k, 0);
  trees.constrained->linkage->solve(in.memory.along.data());
  trees.free = in.memory.along;
  for (int round = 0; round < most_rounds; ++round) {
    make_momenta(in, trees.free, in.h, trees, in.memory.impulse);
    double had = 0, has = 0, work = 0;
    for (std::size_t i = 0; i < tree.moving().size(); ++i) {
      had += 0.5 * power(in.memory.momenta[i], in.memory.chord_before[i]);
      has += 0.5 * power(in.memory.impulse[i], in.memory.chord[i]);
      work += power(in.memory.loads[i], in.memory.chord[i]);
    }
    if (!(has > had + std::max(0.0, work))) break;
    const double share = std::sqrt((had + std::max(0.0, work)) / has);
    for (double& rate : trees.free) rate *= share;
  }
}

// With impulses P along the coordinates the momenta are those of the rates r that solve (40) with P. The
// solve of the step adds M^-1 P by itself: free rates are r - M^-1 P. If the step then finds the foreseen
// impulses, its rates are r, the motion of second order. The difference is of the order h |q'| times that of
// the impulses.
//
// The momenta before the step are those of the displacement that led here, over the step before. Without a
// step before they are those of the rates, which are then of this instant.
void foresee_tree_velocities(const TreeSetting& in, std::span<const double> w, TreeStep& trees,
                             BodyVelocities& free) {
  const Tree& tree = in.tree;
  const Linkage& linkage = *trees.constrained->linkage;
  const std::size_t n = tree.parent().size();
  in.memory.pushed.assign(n, 0.0);
  trees.caused.assign(n, 0.0);
  if (!w.empty()) {
    in.memory.wrenches.clear();
    for (const Index i : linkage.body)
      in.memory.wrenches.insert(in.memory.wrenches.end(), w.begin() + 6 * i, w.begin() + 6 * (i + 1));
    linkage.gather(in.memory.wrenches.data(), in.memory.pushed.data());
    trees.caused = in.memory.pushed;
    linkage.solve(trees.caused.data());
  }
  in.memory.first = trees.free;
  for (std::size_t k = 0; k < n; ++k) trees.free[k] += trees.caused[k];
  trees.slow = is_slow(in.h * std::max(trees.fastest, largest(trees.free)));
  if (trees.slow) {
    make_slow_momenta(in, trees.before, trees, trees.supply);
    for (std::size_t i = 0; i < tree.moving().size(); ++i) trees.supply[i] += trees.slow_supply[i];
    trees.free = in.memory.first;
    return;
  }
  if (in.last > 0) {
    make_momenta(in, trees.before, -in.last, trees, in.memory.momenta);
    in.memory.chord_before = in.memory.chord;
  } else {
    make_slow_momenta(in, trees.before, trees, in.memory.momenta);
    in.memory.chord_before = in.memory.flow;
  }
  in.memory.loads = trees.supply;
  for (std::size_t i = 0; i < tree.moving().size(); ++i) trees.supply[i] += in.memory.momenta[i];
  const bool found = find_rates(in, trees, trees.free);
  if (found && !creates_energy(in, trees)) {
    for (std::size_t k = 0; k < n; ++k) trees.free[k] -= trees.caused[k];
  } else {
    project_momenta(in, trees);
  }
  write_velocities(in, in.frames, trees.free, trees, free);
}

// The velocity of the origin of a body after write_velocities().
static Vec3 origin_velocity(const TreeSetting& in, const TreeStep& trees, std::size_t i) {
  const TreePlace& place = trees.places[i];
  return in.memory.flow[i].linear + cross(in.memory.flow[i].angular, place.pose.position - place.reference);
}

// Per TreeBody: no rate moves it, nor a body that carries it. It keeps the bits of its pose. A product with
// the unit quaternion is exact, but its normalisation rounds. So does an arm that is added and subtracted.
// The pose of a robot at rest would change in each step, and the robot could not sleep (step/sleep.cpp).
static const std::vector<unsigned char>& find_still(const Tree& tree, const BodyVelocities& v,
                                                    std::span<const double> rates) {
  static thread_local std::vector<unsigned char> still;
  still.resize(tree.moving().size());
  for (std::size_t i = 0; i < still.size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    const auto own = rates.subspan(b.first, b.count);
    bool stays = std::all_of(own.begin(), own.end(), [](double rate) { return rate == 0; });
    if (b.above >= 0)
      stays = stays && still[b.above];
    else if (b.joint >= 0 && b.parent >= 0)
      stays = stays && v[b.parent].linear == Vec3{} && v[b.parent].angular == Vec3{};
    still[i] = stays;
  }
  return still;
}

// Coordinates of dofs add; bases and balls turn by the exponential of their rates, about axes that stay. The
// middle velocities are those of the rates in the new pose, since the rates are means over the step.
void move_trees(const TreeSetting& in, const BodyVelocities& v, std::span<const double> rates,
                std::span<const double> rates_then, TreeStep& trees, State& state) {
  const Model& model = in.model;
  const Tree& tree = in.tree;
  const double h = in.h;
  const auto turn = [&](std::size_t k) { return h * Vec3{rates[k], rates[k + 1], rates[k + 2]}; };
  const std::vector<unsigned char>& still = find_still(tree, v, rates);
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    if (still[i]) continue;
    if (b.joint < 0) {
      const Vec3 centre = trees.places[i].centre + turn(b.first);
      const Quat rotation = normalised(exponential(turn(b.first + 3)) * state.orientations[b.body]);
      state.orientations[b.body] = rotation;
      state.positions[b.body] = centre - rotate(rotation, model.body(b.body).centre_of_mass);
      continue;
    }
    for (std::size_t j = 0; j < b.dofs; ++j) state.coordinates[b.first_dof + j] += h * rates[b.first + j];
    if (b.count > b.dofs)
      trees.places[i].ball = normalised(trees.places[i].ball * exponential(turn(b.first + b.dofs)));
  }
  place_all(model, tree, state, still, trees);
  write_poses(tree, trees, still, state);
  note_placed(in, state);
  BodyFrames& moved = in.memory.frames;
  moved.resize(model.bodies());
  BodyVelocities& after = in.memory.velocities;
  after = v;
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i].centre = in.frames[i].centre + h * v[i].linear;
  write_velocities(in, moved, rates_then, trees, after);
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const Index body = tree.moving()[i].body;
    state.middle_velocities[body].linear = origin_velocity(in, trees, i);
    state.middle_velocities[body].angular = in.memory.flow[i].angular;
  }
}

// A tree is one island, so that its bodies have one share. Rates of coordinates change smoothly where the
// velocities of bodies do.
void leave_tree_velocities(const TreeSetting& in, std::span<const double> ahead, const TreeStep& trees,
                           State& state) {
  const Tree& tree = in.tree;
  in.memory.mean = trees.after;
  bool stopped = true;
  for (const double rate : trees.after) stopped = stopped && rate == 0;
  for (const TreeBody& b : tree.moving())
    for (std::size_t k = b.first; k < b.first + b.count && !stopped; ++k)
      in.memory.mean[k] += ahead[b.body] * (trees.after[k] - trees.before[k]);
  write_velocities(in, in.memory.frames, in.memory.mean, trees, in.memory.velocities);
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const Index body = tree.moving()[i].body;
    MiddleVelocity& middle = state.middle_velocities[body];
    state.linear_velocities[body] = middle.left_linear = origin_velocity(in, trees, i);
    state.angular_velocities[body] = middle.left_angular = in.memory.flow[i].angular;
  }
}

// The state holds impulses of springs, dampers and drives per dof as one sum, as their row would give it.
//
// A ball has the inertia of its drive here; its spring and damper are rows. Columns of a reversed joint are
// -1 times the axes of A.
void store_drive_impulses(const TreeSetting& in, const TreeStep& trees, State& state) {
  const Tree& tree = in.tree;
  const auto impulse = [&](std::size_t k) { return drive_impulse(in, trees, k, trees.after[k]); };
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    if (b.joint < 0) continue;
    for (std::size_t j = 0; j < b.dofs; ++j)
      state.dof_impulses[b.first_dof + j].passive += impulse(b.first + j);
    Vec3 ball;
    for (std::size_t k = b.first + b.dofs; k < b.first + b.count; ++k)
      ball += (b.reversed ? -1 : 1) * impulse(k) * trees.columns[k].angular;
    state.ball_impulses[b.joint] += rotate(conjugate(trees.places[i].frame_b.rotation), ball);
  }
}

}  // namespace amontons
