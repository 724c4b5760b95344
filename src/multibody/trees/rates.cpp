// Free rates balance the momenta of two displacements, the one that led here and the next one. Nothing here
// differentiates M: its velocity terms are the differences of these momenta, docs/algorithm.md (40).
#include "multibody/trees/rates.hpp"

#include <algorithm>
#include <cmath>

#include "multibody/bodies/motion.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/trees/policy.hpp"
#include "multibody/trees/poses.hpp"

namespace amontons {

namespace {

// Forces along a coordinate that are linear in its rate act implicitly, as those of rows (drive_terms).
//
// The impulse along a coordinate of its spring, damper and inertia if it ends with a rate.
double drive_impulse(const TreeStep& trees, std::size_t k, double rate, double h, double last) {
  const TreeDrive& d = trees.drives[k];
  const DriveShares s = drive_shares(h, last, d.euler);
  const double before = trees.before[k];
  return -0.5 * (last + h) *
             (d.stiffness * (d.stretch + s.stretch_after * rate + s.stretch_before * before) +
              d.damping * (s.rate_after * rate + s.rate_before * before)) -
         d.inertia * (rate - before);
}

// The world has none. A driven body has that of its given velocity, whose centre of mass moves straight.
//
// The flow of a body of the model with the velocity v, at a reference point.
Flow flow_of(const BodyFrames& frames, const BodyVelocities& v, Index body, const Vec3& reference) {
  if (body < 0) return {};
  return from_point(v[body].linear, v[body].angular, frames[body].centre - reference);
}

// Velocities of bodies from rates; trees.flow are the flows. A tree on a driven body begins with its flow.
void write_velocities(const Forest& forest, const BodyFrames& frames, std::span<const double> rates,
                      TreeStep& trees, BodyVelocities& v) {
  trees.flow.resize(forest.bodies.size());
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
    const TreePlace& place = trees.places[i];
    const Index above = b.joint < 0 || b.parent < 0 ? -1 : forest.number[b.parent];
    Flow f = above >= 0 ? trees.flow[above] : flow_of(frames, v, b.parent, place.reference);
    for (std::size_t k = b.first; k < b.first + b.count; ++k) f += rates[k] * trees.columns[k];
    trees.flow[i] = f;
    v[b.body] = {f.linear + cross(f.angular, place.centre - place.reference), f.angular};
  }
}

// The pose of a body on its joint after the coordinates have moved with the rates for h.
Transform moved_on_joint(const Model& model, const TreeBody& b, const TreePlace& place,
                         const Transform& parent, std::span<const double> coordinates,
                         std::span<const double> rates, double h, const TreeStep& trees) {
  const Joint& joint = model.joint(b.joint);
  Transform relative;
  for (std::size_t i = 0; i < b.dofs; ++i) {
    const Dof& dof = joint.dofs[i];
    const double way = h * rates[b.first + i];
    const Quat turn =
        dof.kind == Dof::Kind::hinge ? exponential(way * dof.axis) * trees.turns[b.first + i] : Quat{};
    append_dof(dof, coordinates[b.first_dof + i] + way, turn, relative);
  }
  if (b.count > b.dofs) {
    const double* w = &rates[b.first + b.dofs];
    relative.rotation = relative.rotation * (place.ball * exponential(h * Vec3{w[0], w[1], w[2]}));
  }
  return parent * (b.fore * (b.reversed ? inverse(relative) : relative) * b.aft);
}

// Impulses along the coordinates of impulses on the bodies, which are summed along the trees: J' by the
// columns. Bodies come after their parents, so that one pass from the last to the first suffices.
void project(const Forest& forest, std::vector<Flow>& impulses, TreeStep& trees) {
  for (std::size_t i = forest.bodies.size(); i-- > 0;) {
    const TreeBody& b = forest.bodies[i];
    for (std::size_t k = b.first; k < b.first + b.count; ++k)
      trees.along[k] = power(impulses[i], trees.columns[k]);
    if (const Index above = b.joint < 0 || b.parent < 0 ? -1 : forest.number[b.parent]; above >= 0)
      impulses[above] += impulses[i];
  }
}

}  // namespace

void make_momenta(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                  const BodyVelocities& start, std::span<const double> rates, double h, TreeStep& trees,
                  std::vector<Flow>& momenta) {
  trees.moved.resize(forest.bodies.size());
  momenta.resize(forest.bodies.size());
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
    const TreePlace& place = trees.places[i];
    Transform& pose = trees.moved[i];
    if (b.joint < 0) {
      const double* r = &rates[b.first];
      pose = moved(frames[b.body], {{r[0], r[1], r[2]}, {r[3], r[4], r[5]}}, h);
    } else {
      const Index above = b.parent < 0 ? -1 : forest.number[b.parent];
      const Transform parent = above >= 0      ? trees.moved[above]
                               : b.parent >= 0 ? moved(frames[b.parent], start[b.parent], h)
                                               : Transform{};
      pose = moved_on_joint(model, b, place, parent, state.coordinates, rates, h, trees);
    }
    // The rotation vector of the turn is its axis times the angle, so that spin = turn / h is the mean
    // angular velocity. Halfway the inertia has turned by half of it, exp(turn / 2) I exp(-turn / 2), and the
    // spin not at all, as it is the axis: L = exp(turn / 2) (I spin).
    const Vec3 way = pose(model.body(b.body).centre_of_mass) - place.centre;
    const Vec3 turn = logarithm(pose.rotation * conjugate(place.pose.rotation));
    const Vec3 p = (model.body(b.body).mass / h) * way;
    const Vec3 spin = rotate(exponential(0.5 * turn), frames[b.body].inertia * ((1 / h) * turn));
    momenta[i] = {p, spin + cross(place.centre - place.reference, p)};
  }
}

// Parents and bodies as they move, relative to each other: an error of one joint does not reach the next one.
// The rest of the spin after the dofs of a ball is that of the ball.
void read_rates(const Forest& forest, const TreeStep& trees, const BodyFrames& frames,
                const BodyVelocities& v, std::vector<double>& rates) {
  rates.resize(forest.parent.size());
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
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

// The change of each body's momentum, from the displacement before the step to the one after it, is the
// impulse of loads and joints. Those of joints do no work along the columns, which leaves one equation per
// coordinate. This is the discrete form of d'Alembert's principle (Marsden, West, Acta Numerica 10, 2001): of
// second order, and the momentum of a free tree is constant. M is its derivative up to a share h |q'|, by
// which each round of Newton's method reduces the error. `pushed`: impulses along the coordinates.
void find_rates(const Model& model, const Forest& forest, const State& state, double h, double last_step,
                const BodyFrames& frames, const BodyVelocities& start, std::span<const double> pushed,
                int rounds, TreeStep& trees, std::vector<double>& rates) {
  const std::size_t n = forest.parent.size();
  trees.along.resize(n);
  double last = INFINITY;
  for (int round = 0; round < rounds; ++round) {
    // The residual: the momenta before the step and all impulses, less the momenta after it.
    make_momenta(model, forest, state, frames, start, rates, h, trees, trees.impulse);
    for (std::size_t i = 0; i < forest.bodies.size(); ++i)
      trees.impulse[i] = trees.supply[i] - trees.impulse[i];
    project(forest, trees.impulse, trees);
    for (std::size_t k = 0; k < n; ++k)
      trees.along[k] += drive_impulse(trees, k, rates[k], h, last_step) + (pushed.empty() ? 0.0 : pushed[k]);
    trees.constrained->linkage->solve(trees.along.data());
    double change = 0;
    for (std::size_t k = 0; k < n; ++k) {
      rates[k] += trees.along[k];
      change = std::max(change, std::abs(trees.along[k]));
      trees.fastest = std::max(trees.fastest, std::abs(rates[k]));
    }
    // It ends at rounding, too: below it changes no longer fall.
    if (!(change > trees::rate_precision * trees.fastest && change < 0.5 * last)) break;
    last = change;
  }
}

}  // namespace

// The momenta of bodies that move with the rates `before`, at one instant.
static void make_first_momenta(const Forest& forest, const BodyFrames& frames, const BodyVelocities& start,
                               TreeStep& trees) {
  trees.velocities = start;
  write_velocities(forest, frames, trees.before, trees, trees.velocities);
  trees.supply.resize(forest.bodies.size());
  for (std::size_t i = 0; i < forest.bodies.size(); ++i)
    trees.supply[i] = momentum_of(trees.inertias[i], trees.flow[i]);
}

// The momenta before the step are those of the displacement that led here, over the step before. Without a
// step before they are those of the rates, which are then of this instant.
void make_free_tree_velocities(const Model& model, const Forest& forest, const State& state, double h,
                               double last, const BodyFrames& frames, const BodyVelocities& start,
                               const std::vector<BodyImpulse>& loads, TreeStep& trees, BodyVelocities& free) {
  read_rates(forest, trees, frames, start, trees.before);
  const double kick = 0.5 * (last + h);
  if (last > 0)
    make_momenta(model, forest, state, frames, start, trees.before, -last, trees, trees.supply);
  else
    make_first_momenta(forest, frames, start, trees);
  const Vec3& gravity = model.description().gravity;
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const Index body = forest.bodies[i].body;
    const Vec3 weight = model.body(body).mass * model.body(body).gravity_scale * gravity;
    const Vec3 push = kick * weight + loads[body].force;
    const Vec3& turn = loads[body].torque;
    trees.supply[i] += {push, turn + cross(trees.places[i].centre - trees.places[i].reference, push)};
  }
  trees.free = trees.before;
  trees.fastest = 0;
  for (const double rate : trees.before) trees.fastest = std::max(trees.fastest, std::abs(rate));
  find_rates(model, forest, state, h, last, frames, start, {}, trees::first_rounds, trees, trees.free);
  write_velocities(forest, frames, trees.free, trees, free);
}

// With impulses P along the coordinates the momenta are those of the rates r that solve (40) with P. The
// solve of the step adds M^-1 P by itself: free rates are r - M^-1 P. If the step then finds the foreseen
// impulses, its rates are r, the motion of second order. The difference is of the order h |q'| times that of
// the impulses.
void foresee_tree_velocities(const Model& model, const Forest& forest, const State& state, double h,
                             double last, const BodyFrames& frames, const BodyVelocities& start,
                             std::span<const double> w, TreeStep& trees, BodyVelocities& free) {
  const Linkage& linkage = *trees.constrained->linkage;
  const std::size_t n = forest.parent.size();
  trees.pushed.assign(n, 0.0);
  trees.caused.assign(n, 0.0);
  if (!w.empty()) {
    trees.wrenches.clear();
    for (const Index i : linkage.body)
      trees.wrenches.insert(trees.wrenches.end(), w.begin() + 6 * i, w.begin() + 6 * (i + 1));
    linkage.gather(trees.wrenches.data(), trees.pushed.data());
    trees.caused = trees.pushed;
    linkage.solve(trees.caused.data());
  }
  for (std::size_t k = 0; k < n; ++k) trees.free[k] += trees.caused[k];
  find_rates(model, forest, state, h, last, frames, start, trees.pushed, trees::most_rounds, trees,
             trees.free);
  for (std::size_t k = 0; k < n; ++k) trees.free[k] -= trees.caused[k];
  write_velocities(forest, frames, trees.free, trees, free);
}

// The velocity of the origin of a body after write_velocities().
static Vec3 origin_velocity(const TreeStep& trees, std::size_t i) {
  const TreePlace& place = trees.places[i];
  return trees.flow[i].linear + cross(trees.flow[i].angular, place.pose.position - place.reference);
}

// Coordinates of dofs add; bases and balls turn by the exponential of their rates, about axes that stay. The
// middle velocities are those of the rates in the new pose, since the rates are means over the step.
void move_trees(const Model& model, const Forest& forest, const BodyFrames& frames, const BodyVelocities& v,
                double h, std::span<const double> rates, std::span<const double> rates_then, TreeStep& trees,
                State& state) {
  const auto turn = [&](std::size_t k) { return h * Vec3{rates[k], rates[k + 1], rates[k + 2]}; };
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
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
  place_all(model, forest, state, trees);
  write_poses(forest, trees, state);
  BodyFrames& moved = trees.frames;
  moved.resize(model.bodies());
  BodyVelocities& after = trees.velocities;
  after = v;
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i].centre = frames[i].centre + h * v[i].linear;
  write_velocities(forest, moved, rates_then, trees, after);
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const Index body = forest.bodies[i].body;
    state.middle_velocities[body].linear = origin_velocity(trees, i);
    state.middle_velocities[body].angular = trees.flow[i].angular;
  }
}

// A tree is one island, so that its bodies have one share. Rates of coordinates change smoothly where the
// velocities of bodies do.
void leave_tree_velocities(const Forest& forest, std::span<const double> ahead, TreeStep& trees,
                           State& state) {
  trees.mean = trees.after;
  bool stopped = true;
  for (const double rate : trees.after) stopped = stopped && rate == 0;
  for (const TreeBody& b : forest.bodies)
    for (std::size_t k = b.first; k < b.first + b.count && !stopped; ++k)
      trees.mean[k] += ahead[b.body] * (trees.after[k] - trees.before[k]);
  write_velocities(forest, trees.frames, trees.mean, trees, trees.velocities);
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const Index body = forest.bodies[i].body;
    MiddleVelocity& middle = state.middle_velocities[body];
    state.linear_velocities[body] = middle.left_linear = origin_velocity(trees, i);
    state.angular_velocities[body] = middle.left_angular = trees.flow[i].angular;
  }
}

// The state holds impulses of springs, dampers and drives per dof as one sum, as their row would give it.
//
// A ball has the inertia of its drive here; its spring and damper are rows. Columns of a reversed joint are
// -1 times the axes of A.
void store_drive_impulses(const Forest& forest, double h, double last, const TreeStep& trees, State& state) {
  const auto impulse = [&](std::size_t k) { return drive_impulse(trees, k, trees.after[k], h, last); };
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
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
