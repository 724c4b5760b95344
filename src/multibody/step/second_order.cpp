// The step is a leapfrog: impulses act on the velocities in the pose q at its start, and bodies then move
// with v+ for h. Let v- be the velocities of the step before. The kinetic energy changes by x' D (v- + v+) /
// 2, the work of the impulses x along the mean of the velocities.
//
// Joints. D v+ = 0 in the pose q is of first order. A body on a circle moves along its tangent for a step and
// is projected onto the next one. That loses the share (h w)^2 / 2 of its energy per step. Instead D (v- +
// v+) = 0 is required, docs/algorithm.md (9). The work is then zero for every x, so that energy is kept to
// rounding and cannot grow. v- and v+ are the chords of the circle before and after q, and its tangent
// bisects them. The error of the path is therefore of third order. It is the midpoint rule for the
// velocities, and needs no pose but q.
//
// After an impact the motion is not smooth, and v- is no chord of the circle on which v+ continues. The
// difference e would be reflected in every later step, with alternating sign: energy is kept, but forces are
// not smooth. e is the velocity D v- in the pose in the middle of the last step, where it is zero for a
// chord. It is removed, D (v- + v+) = e, if it is large beside D v-, and partly if it alternates in sign. In
// smooth motion e is small, of second order, and does not alternate: half of it is undone in the next step.
//
// Bodies of trees came along their joints: rates times columns are no chord. Where joints close loops, e is
// that of the mean velocities of the displacement. The reflection keeps the rates, because the differences
// from the chords before and after q cancel, up to second order.
//
// Rows of torques always use D (v- + v+) = e. With reflection, light bodies that spin about a locked
// direction couple with the turn of the axes to a growing motion. The energy of these rows is small.
#include "multibody/step/second_order.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "multibody/contacts/contact_law.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/positions.hpp"
#include "multibody/trees/momenta.hpp"

namespace amontons {

namespace {

// The bodies in the middle of the last step of length h, in which they moved with the velocities v.
struct LastStep {
  const BodyFrames& now;
  const BodyVelocities& v;
  double h;
  const std::vector<Transform>& poses;  // in the middle of the last step

  Vec3 centre(Index body) const { return body < 0 ? Vec3{} : now[body].centre - 0.5 * h * v[body].linear; }
};

// The frames of a joint at another instant; body(i): the pose of a body there.
JointPose pose_at(const JointContext& now, const auto& body) {
  JointPose pose = now.pose;
  if (now.body_a >= 0) pose.a = body(now.body_a) * now.joint->frame_a;
  if (now.body_b >= 0) pose.b = body(now.body_b) * now.joint->frame_b;
  pose.relative = inverse(pose.b) * pose.a;
  return pose;
}

JointPose middle_pose(const JointContext& now, const LastStep& bodies) {
  return pose_at(now, [&](Index body) { return bodies.poses[body]; });
}

// The joint in the middle of the last step, with coordinates to first order, which suffices for directions.
JointContext middle(const JointContext& now, std::span<const double> q, const LastStep& bodies) {
  std::array<double, 6> coordinates{};
  const Screw twist = joint_twist(now, bodies.v);
  for (std::size_t i = 0; i < now.chain.dofs; ++i)
    coordinates[i] = q[i] - 0.5 * bodies.h * dot(now.duals[i], twist);
  JointContext then = now;
  place(then, middle_pose(now, bodies), bodies.centre(now.body_a), bodies.centre(now.body_b),
        std::span(coordinates).first(now.chain.dofs));
  return then;
}

// The part of a relative twist that the joint locks: the remainder after the best fit by the rates of the
// dofs. The rotation of a ball joint is excluded.
JointSlip slip(const JointContext& joint, const BodyVelocities& v) {
  const Screw twist = joint_twist(joint, v);
  const Vec3& between = joint.pose.relative.position;
  if (!is_chain(*joint.joint))  // a rod locks the direction between its points
    return {norm(between) > 0 ? (dot(between, twist.linear) / norm_squared(between)) * between : Vec3{}, {}};
  JointSlip left{twist.linear, twist.angular};
  for (std::size_t i = 0; i < joint.chain.dofs; ++i) {
    const double rate = dot(joint.duals[i], twist);
    left.linear -= rate * joint.chain.screws[i].linear;
    left.angular -= rate * joint.chain.screws[i].angular;
  }
  if (joint.chain.spherical) left.angular = {};
  return left;
}

// slip() of the joint in the middle of the last step. For a hinge no coordinate is needed: A holds its
// anchor, B its axis.
JointSlip middle_slip(const JointContext& now, std::span<const double> q, const LastStep& bodies) {
  if (!is_hinge(*now.joint)) return slip(middle(now, q, bodies), bodies.v);
  const JointPose pose = middle_pose(now, bodies);
  const Vec3 point = pose.a(now.joint->dofs[0].anchor);
  Vec3 linear, angular;
  const auto add = [&](Index body, double sign) {
    if (body < 0) return;
    const BodyVelocity& v = bodies.v[body];
    linear += sign * (v.linear + cross(v.angular, point - bodies.centre(body)));
    angular += sign * v.angular;
  };
  add(now.body_a, 1);
  add(now.body_b, -1);
  const Quat to_joint = conjugate(pose.b.rotation);
  angular = rotate(to_joint, angular);
  return {rotate(to_joint, linear),
          angular - dot(now.duals[0].angular, angular) * now.chain.screws[0].angular};
}

// The part of the last step's slip e that is not reflected. `before`: the slip one step earlier; `reflected`:
// the slip of v- in the pose q.
JointSlip taken_out(const JointSlip& e, const JointSlip& before, const JointSlip& reflected) {
  const double size = step::policy.rough * norm(reflected.linear);
  double share = 0;
  if (norm(e.linear) >= size)
    share = 1;
  else if (dot(before.linear, e.linear) < 0)
    share = norm_squared(e.linear) / (size * size);
  return {share * e.linear, e.angular};
}

// Whether a contact may close within the step with a jump of velocities. One that carried a load in the last
// step and is closed stays closed, or opens: its force changes as smoothly as the motion beside it. One that
// is near without a load, as a slider beside its guide, strikes if it would go farther than closed ones may
// be.
bool may_strike(const StepSetting& step, const Observed& o, const Contact& c, bool carried) {
  const double closed = allowed_error(step.model.length());
  const double start = dot(c.normal, relative_motion(c, o.start).linear);
  const double free = dot(c.normal, relative_motion(c, o.free).linear);
  if (c.gap > closed || (step.last > 0 && !carried))
    return std::max(c.gap, closed) + step.h * std::min(start, free) <= 0;
  return -start > smooth_speed(step.fall(), free - start);
}

// The group of dynamic bodies that joints and contacts connect: its first body.
Index group_of(std::vector<Index>& first, Index body) {
  while (first[body] != body) body = first[body] = first[first[body]];
  return body;
}

// Bodies that touch something and bodies jointed to one, in groups where a contact may strike. Their motion
// is not smooth, and D v+ = 0 damps it. A blow is felt beyond the joint next to it; so a group in which
// nothing strikes has none of them.
const std::vector<unsigned char>& find_near_contacts(const StepSetting& step, const Observed& o) {
  static thread_local std::vector<unsigned char> touching, near;
  static thread_local std::vector<Index> first;  // body of the group
  const std::size_t bodies = step.model.bodies();
  touching.assign(bodies, 0);
  near.assign(bodies, 0);
  if (o.contacts.empty()) return near;
  first.resize(bodies);
  std::iota(first.begin(), first.end(), 0);
  const auto connect = [&](Index a, Index b) {
    if (step.model.is_dynamic(a) && step.model.is_dynamic(b)) first[group_of(first, a)] = group_of(first, b);
  };
  const auto& joints = step.model.description().joints;
  for (const Joint& j : joints) connect(j.body_a, j.body_b);
  for (const Contact& c : o.contacts) connect(c.body_a, c.body_b);
  for (std::size_t i = 0; i < o.contacts.size(); ++i) {
    if (!may_strike(step, o, o.contacts[i], o.known[i] >= 0)) continue;
    for (const Index body : {o.contacts[i].body_a, o.contacts[i].body_b})
      if (step.model.is_dynamic(body)) near[group_of(first, body)] = 1;
  }
  for (const Contact& c : o.contacts)
    for (const Index body : {c.body_a, c.body_b})
      if (step.model.is_dynamic(body)) touching[body] = near[group_of(first, body)];
  near = touching;
  for (const Joint& j : joints) {
    if (!step.model.is_dynamic(j.body_a) || !step.model.is_dynamic(j.body_b)) continue;
    if (touching[j.body_a] || touching[j.body_b]) near[j.body_a] = near[j.body_b] = 1;
  }
  return near;
}

}  // namespace

void reflect_joints(const StepSetting& step, const Observed& o, State& state, JointRows& rows) {
  const auto is_rigid = [&](std::size_t i) {
    return rows.tags[i].kind == RowKind::locked && rows.restraint[i] == Restraint::equality;
  };
  std::size_t first_rigid = 0;
  while (first_rigid < rows.tags.size() && !is_rigid(first_rigid)) ++first_rigid;
  if (first_rigid == rows.tags.size()) return;
  // The first step has no previous one. Bodies count as if they had arrived with their present velocities.
  // The resulting slip belongs to a pose in which they never were, and is removed.
  const bool first = !(step.last > 0);
  static thread_local BodyVelocities before, came;  // before the step, and of the last one
  static thread_local std::vector<Transform> middle;
  came = before = o.start;
  const LastStep last{o.frames, came, first ? step.h : step.last, middle};
  const bool known = !first && !rows.past.empty();
  // Impulses act on the mean spin of the step, v+. The spin at its start and the spin that the impulses leave
  // there differ from it by the same lag: D (omega + (omega+ + lag)) = 0.
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!step.model.is_dynamic(static_cast<Index>(i))) continue;
    before[i].angular += o.spins[i].lag;
    came[i].angular = known ? rows.past[i].velocity.angular
                            : -torque_free_mean(o.frames[i].inertia, -o.start[i].angular, last.h);
  }
  write_mean_before(o.tree_setting(step), last.h, o.trees, came);
  middle.clear();
  for (std::size_t i = 0; i < came.size(); ++i) middle.push_back(moved(o.frames[i], came[i], -0.5 * last.h));
  const std::vector<unsigned char>& near = find_near_contacts(step, o);
  const auto touched = [&near](Index body) { return body >= 0 && near[body]; };
  Index joint = -1;
  bool smooth = true;
  JointSlip out;
  for (std::size_t i = first_rigid; i < rows.tags.size(); ++i) {
    const RowTag& tag = rows.tags[i];
    if (!is_rigid(i)) continue;
    const JointContext& now = o.joints[tag.joint];
    if (tag.joint != joint) {
      joint = tag.joint;
      const auto j = static_cast<std::size_t>(joint);
      const JointSlip e = middle_slip(now, coordinates_of(step.model, state, j), last);
      out = first ? e : taken_out(e, state.joint_slips[j], slip(now, before));
      state.joint_slips[j] = e;
      smooth = !touched(now.body_a) && !touched(now.body_b);
    }
    if (!smooth) continue;
    // The tag's torque is about the origin of frame_a, the slip about the reference point.
    const Vec3 torque = tag.torque - cross(now.arm, tag.force);
    rows.c[i] +=
        row_velocity(rows.jacobian[i], before) - dot(tag.force, out.linear) - dot(torque, out.angular);
    if (!first)
      rows.c[i] -= step::policy.remembered_sag * rows.compliance[i] * rows.x0[i] * (step.h / last.h);
  }
}

// The error of a joint in the pose to which the step leads, of the wrenches of its rows. Its coordinates are
// of first order: their errors lie along dofs, which wrenches of locked directions do not see.
static JointSlip end_error(const JointMotion& in, const JointContext& now, std::span<const double> q) {
  const JointPose pose = pose_at(now, [&](Index i) { return moved(in.frames[i], in.v[i], in.h); });
  if (!is_chain(*now.joint)) {
    const Vec3& between = pose.relative.position;
    return {(1 - now.joint->lower_distance / norm(between)) * between, {}};
  }
  std::array<double, 6> coordinates{};
  const Screw twist = joint_twist(now, in.v);
  for (std::size_t i = 0; i < now.chain.dofs; ++i) coordinates[i] = q[i] + in.h * dot(now.duals[i], twist);
  const ChainKinematics chain =
      chain_kinematics(*now.joint, pose.relative, std::span(coordinates).first(now.chain.dofs));
  return {chain.error.linear, chain.spherical ? Vec3{} : chain.error.angular};
}

double close_joints(const JointMotion& in, const State& state, const std::function<bool(std::size_t)>& counts,
                    JointRows& rows) {
  double largest = 0;
  Index joint = -1;
  JointSlip error;
  for (std::size_t i = 0; i < rows.tags.size(); ++i) {
    const RowTag& tag = rows.tags[i];
    if (tag.kind != RowKind::locked || rows.restraint[i] != Restraint::equality || !counts(i)) continue;
    const JointContext& now = in.joints[tag.joint];
    if (tag.joint != joint) {
      joint = tag.joint;
      error = end_error(in, now, coordinates_of(in.model, state, static_cast<std::size_t>(joint)));
    }
    const Vec3 torque = tag.torque - cross(now.arm, tag.force);
    const double opening = dot(tag.force, error.linear) + dot(torque, error.angular);
    rows.c[i] += opening / in.h;
    largest = std::max(largest, std::abs(opening));
  }
  return largest;
}

// A term within `least` of the last one changes nothing: the problem is then not solved again for it.
bool find_turns(const Reach& reach, double least, const std::vector<Contact>& contacts, ContactFinder& finder,
                std::vector<Vec3>& turns) {
  static thread_local std::vector<Vec3> found;
  finder.find_turns(reach, contacts, least, found);
  turns.resize(contacts.size());
  double change = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Vec3 d = found[i] - turns[i];
    change = std::max({change, std::abs(d.x), std::abs(d.y), std::abs(d.z)});
  }
  if (!(change > least)) return false;
  turns.swap(found);
  return true;
}

}  // namespace amontons
