// Momenta of bodies of trees over a displacement: what the equations for the rates balance (rates.cpp), and
// what joints react to (reactions.cpp).
#include "multibody/trees/momenta.hpp"

#include "multibody/bodies/motion.hpp"
#include "multibody/trees/poses.hpp"

namespace amontons {

namespace {

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

}  // namespace

Flow flow_of(const BodyFrames& frames, const BodyVelocities& v, Index body, const Vec3& reference) {
  if (body < 0) return {};
  return from_point(v[body].linear, v[body].angular, frames[body].centre - reference);
}

void make_flows(const Forest& forest, const BodyFrames& frames, const BodyVelocities& v,
                std::span<const double> rates, TreeStep& trees) {
  trees.flow.resize(forest.bodies.size());
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
    const Index above = b.joint < 0 || b.parent < 0 ? -1 : forest.number[b.parent];
    Flow f = above >= 0 ? trees.flow[above] : flow_of(frames, v, b.parent, trees.places[i].reference);
    for (std::size_t k = b.first; k < b.first + b.count; ++k) f += rates[k] * trees.columns[k];
    trees.flow[i] = f;
  }
}

void make_momenta(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                  const BodyVelocities& start, std::span<const double> rates, double h, TreeStep& trees,
                  std::vector<Flow>& momenta) {
  trees.moved.resize(forest.bodies.size());
  trees.chord.resize(forest.bodies.size());
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
    trees.chord[i] = from_point((1 / h) * way, (1 / h) * turn, place.centre - place.reference);
  }
}

// Rates are constant over the displacement, and velocities are not: their mean is that of the chord.
void change_past(const Model& model, const Forest& forest, const State& state, double h,
                 const BodyFrames& frames, const BodyVelocities& start, TreeStep& trees,
                 std::vector<Past>& past) {
  make_momenta(model, forest, state, frames, start, trees.before, -h, trees, trees.momenta);
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const Index body = forest.bodies[i].body;
    const Transform& pose = trees.moved[i];
    const Vec3 centre = pose(model.body(body).centre_of_mass);
    const Vec3 mean = (1 / h) * (frames[body].centre - centre);
    past[body] = {
        pose, centre, {2 * mean - start[body].linear, 2 * trees.chord[i].angular - start[body].angular}};
  }
}

void subtract_stiffness(const Forest& forest, std::span<const double> rates, TreeStep& trees,
                        std::vector<Flow>& impulses) {
  if (trees.stiffness.empty()) return;
  trees.bias.resize(forest.bodies.size());
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
    const Index above = b.joint < 0 || b.parent < 0 ? -1 : forest.number[b.parent];
    Flow f = above >= 0 ? trees.bias[above] : Flow{};
    for (std::size_t k = b.first; k < b.first + b.count; ++k)
      f += (rates[k] - trees.before[k]) * trees.columns[k];
    trees.bias[i] = f;
    impulses[i].angular -= trees.stiffness[b.body] * f.angular;
  }
}

void make_slow_momenta(const Forest& forest, const BodyFrames& frames, const BodyVelocities& start,
                       std::span<const double> rates, TreeStep& trees, std::vector<Flow>& momenta) {
  momenta.resize(forest.bodies.size());
  make_flows(forest, frames, start, rates, trees);
  for (std::size_t i = 0; i < momenta.size(); ++i) momenta[i] = momentum_of(trees.inertias[i], trees.flow[i]);
}

}  // namespace amontons
