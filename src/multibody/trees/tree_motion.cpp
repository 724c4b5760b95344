// Flows and wrenches of a tree are about one point, the origin of its first body, so that those of bodies
// add. A point of the world would cost digits in proportion to the distance of the tree from it.
//
// In a step: poses follow from coordinates (place_trees), M and its factors from poses (make_tree_masses),
// free rates from the momenta over displacements (make_free_tree_velocities, foresee_tree_velocities). All
// other stages see velocities of bodies and M^-1 as a function. At the end rates are read from the velocities
// of bodies (read_rates), so that whatever a stage did to them counts, and the trees move (move_trees).
//
// The state has no array for trees. Coordinates of dofs are in State::coordinates, turns included; the pose
// of a base and the rotation of a ball are in the poses, rates in the velocities of bodies. A step writes
// what it would read, so that a saved state continues bit for bit.
#include "multibody/trees/tree_motion.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/joints/chain.hpp"
#include "multibody/trees/policy.hpp"

namespace amontons {

namespace {

Flow& operator+=(Flow& a, const Flow& b) {
  a.linear += b.linear;
  a.angular += b.angular;
  return a;
}
Flow operator*(double s, const Flow& a) { return {s * a.linear, s * a.angular}; }
Flow operator-(const Flow& a, const Flow& b) { return {a.linear - b.linear, a.angular - b.angular}; }
double power(const Flow& wrench, const Flow& v) {
  return dot(wrench.linear, v.linear) + dot(wrench.angular, v.angular);
}
// The flow of a velocity at a point, seen at the reference; `arm` from the reference to the point.
Flow from_point(const Vec3& linear, const Vec3& angular, const Vec3& arm) {
  return {linear - cross(angular, arm), angular};
}

// The momentum of a body with the flow v, as a wrench: p = m v_O + omega x m c, L_O = I_O omega + m c x v_O.
Flow momentum_of(const TreeInertia& inertia, const Flow& v) {
  return {inertia.mass * v.linear + cross(v.angular, inertia.first),
          inertia.second * v.angular + cross(inertia.first, v.linear)};
}

Transform pose_in(const State& state, Index body) {
  return body < 0 ? Transform{} : Transform{state.positions[body], state.orientations[body]};
}

// The motion of one dof, after the motions of those before it: T := T exp(s q). A slide moves along its axis.
// A hinge turns about its anchor a, x -> R (x - a) + a.
inline void append_dof(const Dof& dof, double q, const Quat& turn, Transform& relative) {
  if (dof.kind == Dof::Kind::slide) {
    relative.position += q * rotate(relative.rotation, dof.axis);
    return;
  }
  if (!(dof.anchor == Vec3{}))
    relative.position += rotate(relative.rotation, dof.anchor - rotate(turn, dof.anchor));
  relative.rotation = relative.rotation * turn;
}

// The frames of a joint at its coordinates, the columns, and the chain, which rows read. Screws are those of
// chain_kinematics(); errors are zero, as the pose is that of the coordinates. A column is the flow of the
// moving body against its parent: if that body is B of the joint, its sign is the opposite of the screw's.
void place_on_joint(const Model& model, const TreeBody& b, const Transform& parent,
                    std::span<const double> coordinates, TreePlace& place, TreeStep& trees) {
  const Joint& joint = model.joint(b.joint);
  ChainKinematics& chain = place.chain;
  chain.dofs = b.dofs;
  chain.spherical = b.count > b.dofs;
  std::array<Vec3, 6> axes, points;
  Transform relative;
  for (std::size_t i = 0; i < b.dofs; ++i) {
    const Dof& dof = joint.dofs[i];
    const double q = coordinates[b.first_dof + i];
    axes[i] = rotate(relative.rotation, dof.axis);
    points[i] = relative(dof.anchor);
    Quat& turn = trees.turns[b.first + i];
    if (dof.kind == Dof::Kind::hinge) {
      const double half = 0.5 * q, s = elementary::sin(half);
      turn = {elementary::cos(half), s * dof.axis.x, s * dof.axis.y, s * dof.axis.z};
    }
    append_dof(dof, q, turn, relative);
  }
  chain.reference = relative.position;
  for (std::size_t i = 0; i < b.dofs && !chain.spherical; ++i)
    if (joint.dofs[i].kind == Dof::Kind::hinge) chain.reference = points[i];
  if (chain.spherical) relative.rotation = normalised(relative.rotation * place.ball);
  chain.target = place.relative = relative;
  Transform &above = b.reversed ? place.frame_a : place.frame_b,
            &below = b.reversed ? place.frame_b : place.frame_a;
  above = parent * b.fore;
  below = above * (b.reversed ? inverse(relative) : relative);
  const Transform pose = below * b.aft;
  place.pose = {pose.position, normalised(pose.rotation)};
  const TreePlace& root = trees.places[b.root];
  place.reference = &root == &place ? place.pose.position : root.reference;
  const double sign = b.reversed ? -1 : 1;
  const Mat3 to_world = to_matrix(place.frame_b.rotation);
  const Vec3 origin = place.frame_b.position - place.reference;
  for (std::size_t i = 0; i < b.dofs; ++i) {
    const bool hinge = joint.dofs[i].kind == Dof::Kind::hinge;
    const Vec3 axis = sign * (to_world * axes[i]);
    trees.columns[b.first + i] = hinge ? from_point({}, axis, origin + to_world * points[i]) : Flow{axis, {}};
    chain.screws[i] =
        hinge ? Screw{cross(axes[i], chain.reference - points[i]), axes[i]} : Screw{axes[i], {}};
  }
  if (!chain.spherical) return;
  const Mat3 ball = to_matrix(place.frame_a.rotation);
  for (int k = 0; k < 3; ++k)
    trees.columns[b.first + b.dofs + static_cast<std::size_t>(k)] =
        from_point({}, sign * ball.column(k), place.frame_a.position - place.reference);
}

// Wrenches whose power is the rate of a dof: q'_i = <dual_i, twist>, moved to the reference of the tree.
void make_duals(const Model& model, const TreeBody& b, TreePlace& place, TreeStep& trees) {
  if (b.dofs == 0) return;
  place.duals = dual_wrenches(place.chain, model.length());
  const Mat3 to_world = to_matrix(place.frame_b.rotation);
  const Vec3 arm = place.frame_b(place.chain.reference) - place.reference;
  for (std::size_t i = 0; i < b.dofs; ++i) {
    const Vec3 f = to_world * place.duals[i].linear;
    trees.duals[b.first + i] =
        (b.reversed ? -1.0 : 1.0) * Flow{f, to_world * place.duals[i].angular + cross(arm, f)};
  }
}

constexpr Vec3 unit(int k) { return {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0}; }

// A base moves with its centre of mass and turns about it. Between impulses the centre then moves straight.
void place_freely(const Model& model, const TreeBody& b, const State& state, TreePlace& place,
                  TreeStep& trees) {
  place.pose = pose_in(state, b.body);
  place.reference = place.pose.position;
  const Vec3 arm = rotate(place.pose.rotation, model.body(b.body).centre_of_mass);
  for (int k = 0; k < 3; ++k) {
    const std::size_t i = b.first + static_cast<std::size_t>(k);
    trees.columns[i] = {unit(k), {}};
    trees.columns[i + 3] = from_point({}, unit(k), arm);
  }
}

// The rotation of a ball in the poses of the state: what remains of frame_a in frame_b after the dofs.
Quat ball_in(const Model& model, const State& state, const TreeBody& b) {
  const Joint& joint = model.joint(b.joint);
  const Quat a = pose_in(state, joint.body_a).rotation * joint.frame_a.rotation,
             frame_b = pose_in(state, joint.body_b).rotation * joint.frame_b.rotation;
  const Quat target =
      b.dofs == 0 ? Quat{}
                  : chain_kinematics(joint, {}, std::span(state.coordinates).subspan(b.first_dof, b.dofs))
                        .target.rotation;
  return normalised(conjugate(target) * (conjugate(frame_b) * a));
}

// Forward kinematics, parents first. Nothing is read from the poses of bodies beyond a joint.
//
// Poses of all bodies from the coordinates in the state, its poses of bases, and balls.
void place_all(const Model& model, const Forest& forest, const State& state, TreeStep& trees) {
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
    TreePlace& place = trees.places[i];
    if (b.joint < 0) {
      place_freely(model, b, state, place, trees);
    } else {
      const Index above = b.parent < 0 ? -1 : forest.number[b.parent];
      place_on_joint(model, b, above < 0 ? pose_in(state, b.parent) : trees.places[above].pose,
                     state.coordinates, place, trees);
    }
    place.centre = place.pose(model.body(b.body).centre_of_mass);
  }
}

void read_balls(const Model& model, const Forest& forest, const State& state, TreeStep& trees) {
  for (std::size_t i = 0; i < forest.bodies.size(); ++i)
    if (forest.bodies[i].count > forest.bodies[i].dofs && forest.bodies[i].joint >= 0)
      trees.places[i].ball = ball_in(model, state, forest.bodies[i]);
}

// Whether a pose of the state is another one than that of the coordinates. The vector of the quaternion of a
// small turn is half of its rotation vector.
bool was_moved(const Model& model, const State& state, Index body, const Transform& pose) {
  const double size = model.length() + norm(pose.position);
  const Quat turn = conjugate(pose.rotation) * state.orientations[body];
  return !(norm(state.positions[body] - pose.position) <= trees::rounding * size) ||
         !(model.length() * norm(turn.vector()) <= trees::rounding * size);
}

// After a step, and if the user has moved bodies.
void write_poses(const Forest& forest, const TreeStep& trees, State& state) {
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    state.positions[forest.bodies[i].body] = trees.places[i].pose.position;
    state.orientations[forest.bodies[i].body] = trees.places[i].pose.rotation;
  }
}

// Sizes are those of the model: memory is taken in the first step only.
void resize(const Forest& forest, TreeStep& trees) {
  trees.places.resize(forest.bodies.size());
  trees.inertias.resize(forest.bodies.size());
  const std::size_t n = forest.parent.size();
  trees.columns.resize(n);
  trees.duals.resize(n);
  trees.turns.resize(n);
  trees.drives.resize(n);
}

}  // namespace

// A base is where the state says. All else follows from coordinates, and is compared with the state.
//
// The usual case changes nothing: a step left poses and coordinates that agree to rounding. The poses then
// stay as they are, so that to observe a state twice does not change it. Otherwise coordinates are fitted to
// the relative poses of the bodies of each joint, as they are without trees. The base stays where it is, and
// the bodies beyond it follow.
void place_trees(const Model& model, const Forest& forest, State& state, TreeStep& trees) {
  resize(forest, trees);
  read_balls(model, forest, state, trees);
  place_all(model, forest, state, trees);
  const auto moved_body = [&](const TreePlace& place) {
    return was_moved(model, state, forest.bodies[static_cast<std::size_t>(&place - trees.places.data())].body,
                     place.pose);
  };
  if (std::any_of(trees.places.begin(), trees.places.end(), moved_body)) {
    BodyFrames frames(model.bodies());
    for (std::size_t i = 0; i < frames.size(); ++i) frames[i].pose = pose_in(state, static_cast<Index>(i));
    update_coordinates(model, frames, state);
    read_balls(model, forest, state, trees);
    place_all(model, forest, state, trees);
    write_poses(forest, trees, state);
  }
  for (std::size_t i = 0; i < forest.bodies.size(); ++i)
    if (forest.bodies[i].joint >= 0) make_duals(model, forest.bodies[i], trees.places[i], trees);
}

// As place() does for other joints. Only a ball needs the chain of its pose: its rotation vector is the error
// of that chain.
void place_tree_joints(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                       const TreeStep& trees, JointContexts& joints) {
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreeBody& b = forest.bodies[i];
    if (b.joint < 0) continue;
    const TreePlace& place = trees.places[i];
    JointContext& context = joints[b.joint];
    context.pose = {place.frame_a, place.frame_b, place.relative};
    context.axes = to_matrix(place.frame_b.rotation);
    context.chain = place.chain;
    if (place.chain.spherical)
      context.chain = chain_kinematics(*context.joint, place.relative, coordinates_of(model, state, b.joint));
    context.duals = place.duals;
    context.arm = {};
    if (!place.chain.spherical) context.arm = place.chain.reference - place.relative.position;
    const Vec3 point = place.frame_a.position + context.axes * context.arm;
    if (context.body_a >= 0) context.r_a = point - frames[context.body_a].centre;
    if (context.body_b >= 0) context.r_b = point - frames[context.body_b].centre;
  }
}

namespace {

// The parts of a linkage that no step changes: which coordinate moves which body, and where the rows of M
// lie. A row has one entry per coordinate on the way to the root, itself included, that is as many as it is
// deep.
void start_linkage(const Model& model, const Forest& forest, Linkage& linkage) {
  linkage.place.assign(model.bodies(), -1);
  for (std::size_t i = 0; i < model.bodies(); ++i) {
    if (forest.number[i] < 0) continue;
    linkage.place[i] = static_cast<Index>(linkage.body.size());
    linkage.body.push_back(static_cast<Index>(i));
    linkage.last.push_back(forest.bodies[forest.number[i]].last);
  }
  linkage.arm.resize(linkage.body.size());
  linkage.parent = forest.parent;
  linkage.column.resize(forest.parent.size());
  linkage.first.assign(1, 0);
  std::vector<std::size_t> depth(forest.parent.size());
  for (std::size_t k = 0; k < depth.size(); ++k) {
    depth[k] = 1 + (forest.parent[k] < 0 ? 0 : depth[forest.parent[k]]);
    linkage.first.push_back(linkage.first.back() + depth[k]);
  }
  linkage.rows.resize(linkage.first.back());
}

// A linkage that no problem holds any more. The simulation keeps two problems, the last one and the memory of
// the one before, so that the pool has three entries unless a user keeps problems.
std::shared_ptr<ConstrainedBodies> unused_linkage(const Model& model, const Forest& forest, TreeStep& trees) {
  for (const auto& known : trees.pool)
    if (known.use_count() == 1) return known;
  const auto linkage = std::make_shared<Linkage>();
  start_linkage(model, forest, *linkage);
  auto fresh = std::make_shared<ConstrainedBodies>(
      ConstrainedBodies{linkage->body, [of = linkage.get()](double* w) { of->move(w); }, linkage});
  trees.pool.push_back(fresh);
  return fresh;
}

// Inertias about the reference by Steiner's theorem: I_O = R I R' + m (<c, c> 1 - c c').
void make_inertias(const Model& model, const Forest& forest, const BodyFrames& frames, TreeStep& trees) {
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const Index body = forest.bodies[i].body;
    const double m = model.body(body).mass;
    const Vec3 c = frames[body].centre - trees.places[i].reference;
    const double cc = dot(c, c);
    TreeInertia& inertia = trees.inertias[i];
    inertia = {m, m * c, frames[body].inertia};
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 3; ++k) inertia.second(r, k) += m * ((r == k ? cc : 0) - c[r] * c[k]);
  }
}

// Spring, damper and drive of a coordinate, with the impulse -h k (s + h q'+) - h d q'+ - a (q'+ - q'-) as of
// a row (row_terms). In M it is a + h d + h^2 k on the diagonal.
void make_drives(const Model& model, const Forest& forest, const State& state, TreeStep& trees) {
  for (const TreeBody& b : forest.bodies) {
    if (b.joint < 0) continue;
    const Joint& joint = model.joint(b.joint);
    for (std::size_t i = 0; i < b.dofs; ++i) {
      const Dof& dof = joint.dofs[i];
      trees.drives[b.first + i] = {dof.stiffness, state.coordinates[b.first_dof + i] - dof.rest, dof.damping,
                                   dof.armature};
    }
    for (std::size_t i = b.dofs; i < b.count; ++i) trees.drives[b.first + i].inertia = joint.ball_armature;
  }
}

}  // namespace

void make_tree_masses(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                      double h, TreeStep& trees) {
  make_inertias(model, forest, frames, trees);
  make_drives(model, forest, state, trees);
  trees.constrained.reset();
  trees.constrained = tree_masses(model, forest, h, trees);
}

// Composite inertias. Let I be the inertia of all bodies that a body supports. A unit of its column s gives
// the momentum I s. So M = <s', I s> for the columns s' on the way to the root (Featherstone 2008, ch. 6.2).
//
// Bodies come after their parents in the list. From the last one to the first, the inertia of a body is
// complete before it is added to that of its parent. Reference points are those of the tree: inertias add.
std::shared_ptr<ConstrainedBodies> tree_masses(const Model& model, const Forest& forest, double h,
                                               TreeStep& trees) {
  auto masses = unused_linkage(model, forest, trees);
  Linkage& linkage = const_cast<Linkage&>(*masses->linkage);  // no problem holds it
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const TreePlace& place = trees.places[i];
    linkage.arm[linkage.place[forest.bodies[i].body]] = place.centre - place.reference;
  }
  for (std::size_t k = 0; k < forest.parent.size(); ++k) {
    const Flow& s = trees.columns[k];
    linkage.column[k] = {s.linear.x, s.linear.y, s.linear.z, s.angular.x, s.angular.y, s.angular.z};
  }
  trees.carried = trees.inertias;
  for (std::size_t i = forest.bodies.size(); i-- > 0;) {
    const TreeBody& b = forest.bodies[i];
    const TreeInertia& inertia = trees.carried[i];
    for (std::size_t k = b.first; k < b.first + b.count; ++k) {
      const Flow momentum = momentum_of(inertia, trees.columns[k]);
      double* row = &linkage.rows[linkage.first[k]];
      for (auto above = static_cast<Index>(k); above >= 0; above = forest.parent[above])
        *row++ = power(momentum, trees.columns[above]);
      const TreeDrive& drive = trees.drives[k];
      linkage.rows[linkage.first[k]] += drive.inertia + h * (drive.damping + h * drive.stiffness);
    }
    const Index above = b.joint < 0 || b.parent < 0 ? -1 : forest.number[b.parent];
    if (above < 0) continue;
    trees.carried[above].mass += inertia.mass;
    trees.carried[above].first += inertia.first;
    trees.carried[above].second = trees.carried[above].second + inertia.second;
  }
  linkage.factor();
  return masses;
}

namespace {

// Forces along a coordinate that are linear in its rate act implicitly, at the end of the step.
//
// The impulse along a coordinate of its spring, damper and inertia if it ends with a rate.
double drive_impulse(const TreeStep& trees, std::size_t k, double rate, double h) {
  const TreeDrive& d = trees.drives[k];
  return -h * (d.stiffness * (d.stretch + h * rate) + d.damping * rate) -
         d.inertia * (rate - trees.before[k]);
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
void find_rates(const Model& model, const Forest& forest, const State& state, double h,
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
      trees.along[k] += drive_impulse(trees, k, rates[k], h) + (pushed.empty() ? 0.0 : pushed[k]);
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

// The momenta before the step are those of the displacement that led here, over the step before. After the
// first state, or if the user has moved a tree, that displacement is the one of the present rates backwards.
void make_free_tree_velocities(const Model& model, const Forest& forest, const State& state, double h,
                               const BodyFrames& frames, const BodyVelocities& start,
                               const std::vector<BodyImpulse>& loads, TreeStep& trees, BodyVelocities& free) {
  read_rates(forest, trees, frames, start, trees.before);
  const double last = state.impulse_step > 0 ? state.impulse_step : h;
  make_momenta(model, forest, state, frames, start, trees.before, -last, trees, trees.supply);
  const Vec3& gravity = model.description().gravity;
  for (std::size_t i = 0; i < forest.bodies.size(); ++i) {
    const Index body = forest.bodies[i].body;
    const Vec3 weight = model.body(body).mass * model.body(body).gravity_scale * gravity;
    const Vec3 push = h * (weight + state.forces[body]) + loads[body].force;
    const Vec3 turn = h * state.torques[body] + loads[body].torque;
    trees.supply[i] += {push, turn + cross(trees.places[i].centre - trees.places[i].reference, push)};
  }
  trees.free = trees.before;
  trees.fastest = 0;
  for (const double rate : trees.before) trees.fastest = std::max(trees.fastest, std::abs(rate));
  find_rates(model, forest, state, h, frames, start, {}, trees::first_rounds, trees, trees.free);
  write_velocities(forest, frames, trees.free, trees, free);
}

// With impulses P along the coordinates the momenta are those of the rates r that solve (40) with P. The
// solve of the step adds M^-1 P by itself: free rates are r - M^-1 P. If the step then finds the foreseen
// impulses, its rates are r, the motion of second order. The difference is of the order h |q'| times that of
// the impulses.
void foresee_tree_velocities(const Model& model, const Forest& forest, const State& state, double h,
                             const BodyFrames& frames, const BodyVelocities& start, std::span<const double> w,
                             TreeStep& trees, BodyVelocities& free) {
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
  find_rates(model, forest, state, h, frames, start, trees.pushed, trees::most_rounds, trees, trees.free);
  for (std::size_t k = 0; k < n; ++k) trees.free[k] -= trees.caused[k];
  write_velocities(forest, frames, trees.free, trees, free);
}

// Coordinates of dofs add; bases and balls turn by the exponential of their rates, about axes that stay. The
// velocities in the state are those of the rates in the new pose. The rates are means over the step: they
// belong to its middle, as all velocities after a step.
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
    const TreePlace& place = trees.places[i];
    const Flow& f = trees.flow[i];
    state.linear_velocities[body] = f.linear + cross(f.angular, place.pose.position - place.reference);
    state.angular_velocities[body] = f.angular;
  }
}

// The state holds impulses of springs, dampers and drives per dof as one sum, as their row would give it.
//
// A ball has the inertia of its drive here; its spring and damper are rows. Columns of a reversed joint are
// -1 times the axes of A.
void store_drive_impulses(const Forest& forest, double h, const TreeStep& trees, State& state) {
  const auto impulse = [&](std::size_t k) { return drive_impulse(trees, k, trees.after[k], h); };
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
