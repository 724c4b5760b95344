// Forward kinematics. Coordinates are the truth: poses follow from them, and never the other way, except
// where the user has moved bodies.
#include "multibody/trees/poses.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/base/policy.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "multibody/joints/chain.hpp"

namespace amontons {

namespace {

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
    Quat turn;
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

}  // namespace

// Forward kinematics, parents first. Nothing is read from the poses of bodies beyond a joint.
//
// Poses of all bodies from the coordinates in the state, its poses of bases, and balls.
void place_all(const Model& model, const Tree& tree, const State& state, std::span<const unsigned char> still,
               TreeStep& trees) {
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    if (!still.empty() && still[i]) continue;
    const TreeBody& b = tree.moving()[i];
    TreePlace& place = trees.places[i];
    if (b.joint < 0) {
      place_freely(model, b, state, place, trees);
    } else {
      place_on_joint(model, b, b.above < 0 ? pose_in(state, b.parent) : trees.places[b.above].pose,
                     state.coordinates, place, trees);
    }
    place.centre = place.pose(model.body(b.body).centre_of_mass);
  }
}

// After a step, and if the user has moved bodies.
void write_poses(const Tree& tree, const TreeStep& trees, std::span<const unsigned char> still,
                 State& state) {
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    if (!still.empty() && still[i]) continue;
    state.positions[tree.moving()[i].body] = trees.places[i].pose.position;
    state.orientations[tree.moving()[i].body] = trees.places[i].pose.rotation;
  }
}

namespace {

void read_balls(const Model& model, const Tree& tree, const State& state, TreeStep& trees) {
  for (std::size_t i = 0; i < tree.moving().size(); ++i)
    if (tree.moving()[i].count > tree.moving()[i].dofs && tree.moving()[i].joint >= 0)
      trees.places[i].ball = ball_in(model, state, tree.moving()[i]);
}

// Whether the user has moved a body to another pose than that of the coordinates. The vector of the
// quaternion of a small turn is half of its rotation vector.
bool was_moved(const Model& model, const State& state, Index body, const Transform& pose) {
  const double size = model.length() + norm(pose.position);
  const Quat turn = conjugate(pose.rotation) * state.orientations[body];
  return !(norm(state.positions[body] - pose.position) <= base::policy.rounding * size) ||
         !(model.length() * norm(turn.vector()) <= base::policy.rounding * size);
}

// Sizes are those of the model: memory is taken in the first step only.
void resize(const Tree& tree, TreeStep& trees) {
  trees.places.resize(tree.moving().size());
  trees.inertias.resize(tree.moving().size());
  const std::size_t n = tree.parent().size();
  trees.columns.resize(n);
  trees.duals.resize(n);
  trees.drives.resize(n);
}

}  // namespace

// A base is where the state says. All else follows from coordinates, and is compared with the state.
//
// The usual case changes nothing: a step left poses and coordinates that agree to rounding. The poses then
// stay as they are, so that to observe a state twice does not change it. Otherwise coordinates are fitted to
// the relative poses of the bodies of each joint, as they are without trees. The base stays where it is, and
// the bodies beyond it follow.
static void find_places(const Model& model, const Tree& tree, State& state, TreeStep& trees) {
  read_balls(model, tree, state, trees);
  place_all(model, tree, state, {}, trees);
  const auto moved_body = [&](const TreePlace& place) {
    return was_moved(model, state, tree.moving()[static_cast<std::size_t>(&place - trees.places.data())].body,
                     place.pose);
  };
  if (std::any_of(trees.places.begin(), trees.places.end(), moved_body)) {
    BodyFrames frames(model.bodies());
    for (std::size_t i = 0; i < frames.size(); ++i) frames[i].pose = pose_in(state, static_cast<Index>(i));
    update_coordinates(model, frames, state);
    read_balls(model, tree, state, trees);
    place_all(model, tree, state, {}, trees);
    write_poses(tree, trees, {}, state);
  }
}

// The places of the end of a step are those of the start of the next one, bit for bit, unless somebody has
// changed the state meanwhile. The rotation of a ball is not in the state: it is found from poses, with other
// rounding than that of the motion.
void note_placed(const TreeSetting& in, const State& state) {
  for (const TreeBody& b : in.tree.moving())
    if (b.joint >= 0 && b.count > b.dofs) return;
  in.memory.placed.positions = state.positions;
  in.memory.placed.orientations = state.orientations;
  in.memory.placed.coordinates = state.coordinates;
}

// The places need the poses of bases and of driven bodies, too: all of the state is compared.
// Exact comparisons: a state that differs by rounding only is another one, and gets its own places.
static bool is_placed(const TreeSetting& in, const State& state) {
  return !in.memory.placed.coordinates.empty() && in.memory.placed.coordinates == state.coordinates &&
         in.memory.placed.positions == state.positions && in.memory.placed.orientations == state.orientations;
}

void place_trees(const TreeSetting& in, State& state, TreeStep& trees) {
  const Model& model = in.model;
  const Tree& tree = in.tree;
  resize(tree, trees);
  if (!is_placed(in, state)) find_places(model, tree, state, trees);
  in.memory.placed.coordinates.clear();
  for (std::size_t i = 0; i < tree.moving().size(); ++i)
    if (tree.moving()[i].joint >= 0) make_duals(model, tree.moving()[i], trees.places[i], trees);
}

// As place() does for other joints. Only a ball needs the chain of its pose: its rotation vector is the error
// of that chain.
void place_tree_joints(const TreeSetting& in, const State& state, const TreeStep& trees,
                       JointContexts& joints) {
  const Tree& tree = in.tree;
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreeBody& b = tree.moving()[i];
    if (b.joint < 0) continue;
    const TreePlace& place = trees.places[i];
    JointContext& context = joints[b.joint];
    context.first_coordinate = static_cast<Index>(b.first);
    context.pose = {place.frame_a, place.frame_b, place.relative};
    context.axes = to_matrix(place.frame_b.rotation);
    context.chain = place.chain;
    if (place.chain.spherical)
      context.chain =
          chain_kinematics(*context.joint, place.relative, coordinates_of(in.model, state, b.joint));
    context.duals = place.duals;
    context.arm = {};
    if (!place.chain.spherical) context.arm = place.chain.reference - place.relative.position;
    const Vec3 point = place.frame_a.position + context.axes * context.arm;
    if (context.body_a >= 0) context.r_a = point - in.frames[context.body_a].centre;
    if (context.body_b >= 0) context.r_b = point - in.frames[context.body_b].centre;
  }
}

}  // namespace amontons
