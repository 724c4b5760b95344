// Momenta of bodies of trees over a displacement: what the equations for the rates balance (rates.cpp), and
// what joints react to (reactions.cpp).
#include "multibody/trees/momenta.hpp"

namespace amontons {

namespace {

// rotate(q, v) - v with all digits, however small the turn.
Vec3 way_of(const Quat& q, const Vec3& v) {
  const Vec3 t = 2 * cross(q.vector(), v);
  return q.w * t + cross(q.vector(), t);
}

// Displacements x -> p + R x of the bodies of a tree, about its reference point.
//
// A turn about a point.
Transform turned_about(const Vec3& point, const Quat& turn) { return {-way_of(turn, point), turn}; }

// That of a body without a joint over h. Its centre of mass, at `arm`, moves straight.
Transform displaced_freely(const Vec3& arm, const Vec3& linear, const Vec3& angular, double h) {
  Transform way = turned_about(arm, exponential(h * angular));
  way.position += h * linear;
  return way;
}

// That of a body whose coordinates move with the rates for h, on top of `whole`, that of its parent. A dof
// displaces all that lies beyond it along its axis at the start: the axes that lie between it and the world
// then carry the result on. So displacements come in the order of the dofs from the parent to the body.
Transform displaced_on_joint(const TreeBody& b, const TreePlace& place, std::span<const double> rates,
                             double h, const TreeStep& trees, Transform whole) {
  const auto turn_ball = [&] {
    Vec3 turn;
    for (std::size_t k = b.first + b.dofs; k < b.first + b.count; ++k)
      turn += h * rates[k] * trees.columns[k].angular;
    whole = whole * turned_about(place.frame_a.position - place.reference, exponential(turn));
  };
  const bool has_ball = b.count > b.dofs;
  if (has_ball && b.reversed) turn_ball();
  for (std::size_t i = 0; i < b.dofs; ++i) {
    const std::size_t k = b.first + (b.reversed ? b.dofs - 1 - i : i);
    const Flow& s = trees.columns[k];
    const double way = h * rates[k];
    if (s.angular == Vec3{})
      whole.position += rotate(whole.rotation, way * s.linear);
    else  // an axis e through p has the column (p x e, e), and e x (p x e) is its point next to the reference
      whole = whole * turned_about(cross(s.angular, s.linear), exponential(way * s.angular));
  }
  if (has_ball && !b.reversed) turn_ball();
  return whole;
}

// Half of a turn lies in the middle between the unit and its quaternion.
Quat half_of(const Quat& q) {
  const double s = q.w < 0 ? -1 : 1;
  return normalised({1 + s * q.w, s * q.x, s * q.y, s * q.z});
}

}  // namespace

Flow flow_of(const BodyFrames& frames, const BodyVelocities& v, Index body, const Vec3& reference) {
  if (body < 0) return {};
  return from_point(v[body].linear, v[body].angular, frames[body].centre - reference);
}

void make_flows(const TreeSetting& in, const BodyFrames& frames, const BodyVelocities& v,
                std::span<const double> rates, const TreeStep& trees) {
  const Tree& tree = in.tree;
  in.memory.flow.resize(tree.moving().size());
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    Flow f = b.above >= 0 ? in.memory.flow[b.above] : flow_of(frames, v, b.parent, trees.places[i].reference);
    for (std::size_t k = b.first; k < b.first + b.count; ++k) f += rates[k] * trees.columns[k];
    in.memory.flow[i] = f;
  }
}

void make_momenta(const TreeSetting& in, std::span<const double> rates, double h, const TreeStep& trees,
                  std::vector<Flow>& momenta) {
  const Tree& tree = in.tree;
  in.memory.moved.resize(tree.moving().size());
  in.memory.chord.resize(tree.moving().size());
  momenta.resize(tree.moving().size());
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    const TreePlace& place = trees.places[i];
    const Vec3 arm = place.centre - place.reference;
    Transform& moved = in.memory.moved[i];
    if (b.joint < 0) {
      const double* r = &rates[b.first];
      moved = displaced_freely(arm, {r[0], r[1], r[2]}, {r[3], r[4], r[5]}, h);
    } else {
      Transform parent;
      if (b.above >= 0)
        parent = in.memory.moved[b.above];
      else if (b.parent >= 0)
        parent = displaced_freely(in.frames[b.parent].centre - place.reference, in.start[b.parent].linear,
                                  in.start[b.parent].angular, h);
      moved = displaced_on_joint(b, place, rates, h, trees, parent);
    }
    // The rotation vector of the turn is its axis times the angle, so that spin = turn / h is the mean
    // angular velocity. Halfway the inertia has turned by half of it, exp(turn / 2) I exp(-turn / 2), and the
    // spin not at all, as it is the axis: L = exp(turn / 2) (I spin).
    const Vec3 way = moved.position + way_of(moved.rotation, arm);
    const Vec3 turn = logarithm(moved.rotation);
    const Vec3 p = (trees.inertias[i].mass / h) * way;
    const Vec3 spin = rotate(half_of(moved.rotation), in.frames[b.body].inertia * ((1 / h) * turn));
    momenta[i] = {p, spin + cross(arm, p)};
    in.memory.chord[i] = from_point((1 / h) * way, (1 / h) * turn, arm);
  }
}

// The difference between chord and rates is added to the velocities at the start: those that a user gives
// need not be velocities of rates.
void write_mean_before(const TreeSetting& in, double h, const TreeStep& trees, BodyVelocities& mean) {
  const BodyVelocities& start = in.start;
  make_momenta(in, trees.before, -h, trees, in.memory.momenta);
  make_flows(in, in.frames, start, trees.before, trees);
  for (std::size_t i = 0; i < in.tree.moving().size(); ++i) {
    const Index body = in.tree.moving()[i].body;
    const Flow more = in.memory.chord[i] - in.memory.flow[i];
    const Vec3 arm = trees.places[i].centre - trees.places[i].reference;
    mean[body] = {start[body].linear + more.linear + cross(more.angular, arm),
                  start[body].angular + more.angular};
  }
}

// Rates are constant over the displacement, and velocities are not: their mean is that of the chord.
void change_past(const TreeSetting& in, const TreeStep& trees, std::vector<Past>& past) {
  static thread_local BodyVelocities mean;
  const BodyVelocities& start = in.start;
  mean.resize(start.size());
  write_mean_before(in, in.kick(), trees, mean);
  for (std::size_t i = 0; i < in.tree.moving().size(); ++i) {
    const Index body = in.tree.moving()[i].body;
    const TreePlace& place = trees.places[i];
    const Transform& moved = in.memory.moved[i];
    const auto [linear, angular] = mean[body];
    past[body] = {{place.reference + moved(place.pose.position - place.reference),
                   moved.rotation * place.pose.rotation},
                  place.reference + moved(place.centre - place.reference),
                  {2 * linear - start[body].linear, 2 * angular - start[body].angular}};
  }
}

void subtract_stiffness(const TreeSetting& in, std::span<const double> rates, const TreeStep& trees,
                        std::vector<Flow>& impulses) {
  const Tree& tree = in.tree;
  if (trees.stiffness.empty()) return;
  in.memory.bias.resize(tree.moving().size());
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    Flow f = b.above >= 0 ? in.memory.bias[b.above] : Flow{};
    for (std::size_t k = b.first; k < b.first + b.count; ++k)
      f += (rates[k] - trees.before[k]) * trees.columns[k];
    in.memory.bias[i] = f;
    impulses[i].angular -= trees.stiffness[b.body] * f.angular;
  }
}

void make_slow_momenta(const TreeSetting& in, std::span<const double> rates, const TreeStep& trees,
                       std::vector<Flow>& momenta) {
  momenta.resize(in.tree.moving().size());
  make_flows(in, in.frames, in.start, rates, trees);
  for (std::size_t i = 0; i < momenta.size(); ++i)
    momenta[i] = momentum_of(trees.inertias[i], in.memory.flow[i]);
}

}  // namespace amontons
