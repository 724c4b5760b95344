// From coordinates to bodies and back: the product of exponentials of every joint, one after the other.
#include "amontons/multibody/kinematics/motion.hpp"

#include <algorithm>

#include "amontons/multibody/joints/coordinates.hpp"
#include "multibody/joints/chain.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

namespace {

Quat quaternion_at(std::span<const double> q, std::size_t i) { return {q[i], q[i + 1], q[i + 2], q[i + 3]}; }

// Fixed bodies have zero velocity, whatever the state contains.
Twist velocity_in(const Model& model, const State& state, Index body) {
  if (body < 0 || model.body(body).motion == Motion::still) return {};
  return from_point(state.linear_velocities[body], state.angular_velocities[body], state.positions[body]);
}

// The three columns of an angular velocity along the axes of a frame, about its origin.
void turn_columns(const Transform& frame, double sign, std::span<Twist> out) {
  const Mat3 axes = to_matrix(frame.rotation);
  for (int k = 0; k < 3; ++k) out[k] = from_point({}, sign * axes.column(k), frame.position);
}

// The pose of a body on a joint, and its columns. The twists of the dofs are those of A relative to B, in the
// axes of frame_b; if B is the moving body, their sign changes.
Transform place_on_joint(const Joint& joint, const Link& link, const Transform& parent,
                         std::span<const double> q, std::span<Twist> columns) {
  const std::size_t dofs = joint.dofs.size();
  const ChainKinematics chain = chain_kinematics(joint, {}, q.first(dofs));
  Transform relative = chain.target;  // frame_a in frame_b
  if (chain.spherical) relative.rotation = normalised(relative.rotation * quaternion_at(q, dofs));
  Transform b = parent * joint.frame_b, a = b * relative;
  if (link.reversed) {
    a = parent * joint.frame_a;
    b = a * inverse(relative);
  }
  const double sign = link.reversed ? -1 : 1;
  for (std::size_t i = 0; i < dofs; ++i)
    columns[i] = sign * from_point(rotate(b.rotation, chain.screws[i].linear),
                                   rotate(b.rotation, chain.screws[i].angular), b(chain.reference));
  if (chain.spherical) turn_columns(a, sign, columns.subspan(dofs));
  const Transform pose = link.reversed ? b * inverse(joint.frame_b) : a * inverse(joint.frame_a);
  return {pose.position, normalised(pose.rotation)};
}

Transform place_freely(std::span<const double> q, std::span<Twist> columns) {
  const Transform pose{{q[0], q[1], q[2]}, quaternion_at(q, 3)};
  columns[0] = {{1, 0, 0}, {}};
  columns[1] = {{0, 1, 0}, {}};
  columns[2] = {{0, 0, 1}, {}};
  turn_columns(pose, 1, columns.subspan(3));
  return pose;
}

// Rates of the dofs of a joint, and for a ball the remaining angular velocity, from the velocities of its
// bodies: the inverse of place_on_joint().
void read_joint(const Model& model, const State& state, const Link& link, std::span<const double> coordinates,
                std::span<double> q, std::span<double> qd) {
  const Joint& joint = model.joint(link.joint);
  const std::size_t dofs = joint.dofs.size();
  const Transform a = pose_in(state, joint.body_a) * joint.frame_a,
                  b = pose_in(state, joint.body_b) * joint.frame_b;
  const Transform relative = inverse(b) * a;
  std::copy_n(coordinates.begin(), dofs, q.begin());
  const ChainKinematics chain = chain_kinematics(joint, relative, q.first(dofs));
  const auto duals = dual_wrenches(chain, model.length());
  const Twist of_a = velocity_in(model, state, joint.body_a), of_b = velocity_in(model, state, joint.body_b);
  const Vec3 point = b(chain.reference);
  const Quat to_b = conjugate(b.rotation);
  const Screw twist{rotate(to_b, velocity_at(of_a, point) - velocity_at(of_b, point)),
                    rotate(to_b, of_a.angular - of_b.angular)};
  Vec3 left = twist.angular;
  for (std::size_t i = 0; i < dofs; ++i) {
    qd[i] = dot(duals[i], twist);
    left -= qd[i] * chain.screws[i].angular;
  }
  if (!chain.spherical) return;
  Quat ball = conjugate(chain.target.rotation) * relative.rotation;
  if (ball.w < 0) ball = {-ball.w, -ball.x, -ball.y, -ball.z};
  const Vec3 spin = rotate(conjugate(relative.rotation), left);
  std::copy_n(std::array{ball.w, ball.x, ball.y, ball.z}.begin(), 4, q.begin() + dofs);
  std::copy_n(spin.array().begin(), 3, qd.begin() + dofs);
}

void read_freely(const State& state, Index body, std::span<double> q, std::span<double> qd) {
  const Quat& r = state.orientations[body];
  const Vec3 spin = rotate(conjugate(r), state.angular_velocities[body]);
  std::copy_n(state.positions[body].array().begin(), 3, q.begin());
  std::copy_n(std::array{r.w, r.x, r.y, r.z}.begin(), 4, q.begin() + 3);
  std::copy_n(state.linear_velocities[body].array().begin(), 3, qd.begin());
  std::copy_n(spin.array().begin(), 3, qd.begin() + 3);
}

std::vector<Transform> poses_in(const State& state) {
  std::vector<Transform> poses;
  for (std::size_t i = 0; i < state.positions.size(); ++i)
    poses.push_back(pose_in(state, static_cast<Index>(i)));
  return poses;
}

// The velocity and the acceleration of a body.
struct LinkMotion {
  Twist v{}, a{};
};

// Adds the motion of a link's coordinates to that of its parent, in their order from the parent on: each
// column moves with all columns before it. The three of a ball (and of a floating base) turn together, so
// that none moves another.
void add_motion(const Link& link, std::size_t dofs, std::span<const Twist> columns,
                std::span<const double> qd, std::span<const double> qdd, LinkMotion& motion) {
  Twist &v = motion.v, &a = motion.a;
  const auto add = [&](std::size_t first, std::size_t count) {
    Twist dv{};
    for (std::size_t i = first; i < first + count; ++i) {
      dv += qd[i] * columns[i];
      a += qdd[i] * columns[i];
    }
    a += carried(v, dv);
    v += dv;
  };
  const std::size_t ball = link.v - dofs;
  if (link.reversed && ball > 0) add(dofs, ball);
  for (std::size_t i = 0; i < dofs; ++i) add(link.reversed ? dofs - 1 - i : i, 1);
  if (!link.reversed && ball > 0) add(dofs, ball);
}

}  // namespace

std::vector<double> fitted_coordinates(const Model& model, std::span<const Transform> poses,
                                       std::vector<double> near) {
  BodyFrames frames(poses.size());
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].pose = poses[i];
  update_coordinates(model, frames, near);
  return near;
}

// The coordinates in the state are those at the start of the last step.
Coordinates read_coordinates(const Tree& tree, const State& state) {
  const Model& model = tree.model();
  const std::vector<double> coordinates = fitted_coordinates(model, poses_in(state), state.coordinates);
  Coordinates out{std::vector<double>(tree.nq()), std::vector<double>(tree.nv())};
  for (const Link& link : tree.links()) {
    const std::span<double> q = std::span(out.q).subspan(link.first_q, link.q),
                            qd = std::span(out.qd).subspan(link.first_v, link.v);
    if (link.joint < 0) {
      read_freely(state, link.body, q, qd);
      continue;
    }
    const auto first = static_cast<std::size_t>(model.first_dof(link.joint));
    read_joint(model, state, link, std::span(coordinates).subspan(first), q, qd);
  }
  return out;
}

// The coordinates of joints are in q. To fit them to the poses again would take most of the time.
std::vector<double> read_rates(const Tree& tree, const State& state, std::span<const double> q) {
  Coordinates out{std::vector<double>(tree.nq()), std::vector<double>(tree.nv())};
  for (const Link& link : tree.links()) {
    const std::span<double> own = std::span(out.q).subspan(link.first_q, link.q),
                            qd = std::span(out.qd).subspan(link.first_v, link.v);
    if (link.joint < 0)
      read_freely(state, link.body, own, qd);
    else
      read_joint(tree.model(), state, link, q.subspan(link.first_q), own, qd);
  }
  return out.qd;
}

TreePose pose_of(const Tree& tree, const State& state, std::span<const double> q) {
  TreePose pose;
  pose.columns.resize(tree.nv());
  pose.bodies = poses_in(state);
  for (const std::size_t k : tree.order()) {
    const Link& link = tree.links()[k];
    const std::span<const double> own = q.subspan(link.first_q, link.q);
    const std::span<Twist> columns = std::span(pose.columns).subspan(link.first_v, link.v);
    const Transform parent = link.parent < 0 ? Transform{} : pose.bodies[link.parent];
    pose.bodies[link.body] = link.joint < 0
                                 ? place_freely(own, columns)
                                 : place_on_joint(tree.model().joint(link.joint), link, parent, own, columns);
  }
  return pose;
}

std::vector<double> joint_coordinates_at(const Tree& tree, const TreePose& pose, std::span<const double> q,
                                         std::vector<double> near) {
  const Model& model = tree.model();
  std::vector<double> all = fitted_coordinates(model, pose.bodies, std::move(near));
  for (const Link& link : tree.links())
    if (link.joint >= 0)
      std::copy_n(q.begin() + static_cast<std::ptrdiff_t>(link.first_q), model.joint(link.joint).dofs.size(),
                  all.begin() + static_cast<std::ptrdiff_t>(model.first_dof(link.joint)));
  return all;
}

std::vector<double> moved_along(const Tree& tree, std::span<const double> q, std::span<const double> qd,
                                double h) {
  std::vector<double> out(q.begin(), q.end());
  for (const Link& link : tree.links()) {
    const std::size_t plain = link.joint < 0 ? 3 : tree.model().joint(link.joint).dofs.size();
    for (std::size_t i = 0; i < plain; ++i) out[link.first_q + i] += h * qd[link.first_v + i];
    if (link.q == plain) continue;
    const std::size_t v = link.first_v + plain;
    const Quat r = normalised(quaternion_at(q, link.first_q + plain) *
                              exponential(h * Vec3{qd[v], qd[v + 1], qd[v + 2]}));
    std::copy_n(std::array{r.w, r.x, r.y, r.z}.begin(), 4,
                out.begin() + static_cast<std::ptrdiff_t>(link.first_q + plain));
  }
  return out;
}

// The inverse of moved_along. Two rotation vectors lead to one orientation: the logarithm is the shorter one.
std::vector<double> change_along(const Tree& tree, std::span<const double> first,
                                 std::span<const double> last) {
  std::vector<double> out(tree.nv());
  for (const Link& link : tree.links()) {
    const std::size_t plain = link.joint < 0 ? 3 : tree.model().joint(link.joint).dofs.size();
    for (std::size_t i = 0; i < plain; ++i)
      out[link.first_v + i] = last[link.first_q + i] - first[link.first_q + i];
    if (link.q == plain) continue;
    const std::size_t at = link.first_q + plain;
    const Vec3 turn = logarithm(conjugate(quaternion_at(first, at)) * quaternion_at(last, at));
    std::copy_n(turn.array().begin(), 3, out.begin() + static_cast<std::ptrdiff_t>(link.first_v + plain));
  }
  return out;
}

// A body with constant velocity has the spatial acceleration -omega x v, because the flow at a fixed place
// changes as the body moves.
TreeMotion motion_of(const Tree& tree, const State& state, const TreePose& pose, std::span<const double> qd,
                     std::span<const double> qdd) {
  const Model& model = tree.model();
  TreeMotion motion{std::vector<Twist>(model.bodies()), std::vector<Twist>(model.bodies())};
  for (std::size_t i = 0; i < model.bodies(); ++i) {
    if (model.body(static_cast<Index>(i)).motion != Motion::kinematic) continue;
    motion.velocities[i] = velocity_in(model, state, static_cast<Index>(i));
    motion.accelerations[i] = {-cross(state.angular_velocities[i], state.linear_velocities[i]), {}};
  }
  for (const std::size_t k : tree.order()) {
    const Link& link = tree.links()[k];
    LinkMotion moved;
    if (link.parent >= 0) moved = {motion.velocities[link.parent], motion.accelerations[link.parent]};
    // A floating base slides along three axes, then turns.
    const std::size_t dofs = link.joint < 0 ? 3 : model.joint(link.joint).dofs.size();
    add_motion(link, dofs, std::span(pose.columns).subspan(link.first_v, link.v),
               qd.subspan(link.first_v, link.v), qdd.subspan(link.first_v, link.v), moved);
    motion.velocities[link.body] = moved.v;
    motion.accelerations[link.body] = moved.a;
  }
  return motion;
}

void write_poses(const Tree& tree, std::span<const double> q, State& state) {
  const TreePose pose = pose_of(tree, state, q);
  for (const Link& link : tree.links()) {
    state.positions[link.body] = pose.bodies[link.body].position;
    state.orientations[link.body] = pose.bodies[link.body].rotation;
  }
  // Copied in place: users hold views of the memory.
  const std::vector<double> all = joint_coordinates_at(tree, pose, q, state.coordinates);
  std::copy(all.begin(), all.end(), state.coordinates.begin());
}

void write_velocities(const Tree& tree, std::span<const double> q, std::span<const double> qd, State& state) {
  const TreePose pose = pose_of(tree, state, q);
  const TreeMotion motion = motion_of(tree, state, pose, qd, std::vector<double>(tree.nv()));
  for (const Link& link : tree.links()) {
    const Twist& twist = motion.velocities[link.body];
    state.linear_velocities[link.body] = velocity_at(twist, pose.bodies[link.body].position);
    state.angular_velocities[link.body] = twist.angular;
  }
}

}  // namespace amontons
