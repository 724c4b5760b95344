// Recursive Newton-Euler equations over the displacements of the step, from the leaves to the root. A joint
// carries the change of momentum of all bodies beyond it less the other impulses on them.
#include "multibody/trees/reactions.hpp"

#include "multibody/trees/momenta.hpp"

namespace amontons {

namespace {

// A wrench W splits into efforts along the dofs and the rest: W = sum_i <W, screw_i> dual_i + locked, because
// <dual_i, screw_k> = 1 for i = k, else 0. Rows along a dof, drives and motors act by the duals, so that all
// of them drop out here, whoever supplies them. A ball transmits no torque about its centre.
//
// This is the locked part of a wrench on A at the reference, axes of frame_b.
Screw locked_part(const ChainKinematics& chain, const std::array<Screw, 6>& duals, Screw wrench) {
  if (chain.spherical) wrench.angular = {};
  const Screw whole = wrench;
  for (std::size_t i = 0; i < chain.dofs; ++i) {
    const double effort = dot(whole, chain.screws[i]);
    wrench.linear -= effort * duals[i].linear;
    wrench.angular -= effort * duals[i].angular;
  }
  return wrench;
}

// From the leaves to the root, as the children of a body follow it in the list.
//
// Adds the locked part of what each joint carries. in.memory.impulse: the change of momentum of each body
// less its loads.
void add_reactions(const TreeSetting& in, const JointContexts& joints, std::span<const double> w,
                   const TreeStep& trees, std::vector<JointWrench>& wrenches) {
  const Tree& tree = in.tree;
  for (std::size_t i = tree.moving().size(); i-- > 0;) {
    const TreeBody& b = tree.moving()[i];
    const Vec3& O = trees.places[i].reference;
    Flow& f = in.memory.impulse[i];
    const double* row = &w[6 * static_cast<std::size_t>(b.body)];
    const Vec3 push{row[0], row[1], row[2]};
    f.linear -= push;
    f.angular -= Vec3{row[3], row[4], row[5]} + cross(trees.places[i].centre - O, push);
    if (b.joint < 0) continue;
    const JointContext& joint = joints[b.joint];
    const double sign = b.reversed ? -1 : 1;
    const Vec3 point = joint.pose.a.position + joint.axes * joint.arm;
    const Mat3 to_joint = transposed(joint.axes);
    const Screw locked = locked_part(
        joint.chain, joint.duals,
        {to_joint * (sign * f.linear), to_joint * (sign * (f.angular - cross(point - O, f.linear)))});
    JointWrench& wrench = wrenches[b.joint];
    wrench.force += locked.linear;
    wrench.torque += locked.angular + cross(joint.arm, locked.linear);
    if (b.above >= 0) in.memory.impulse[b.above] += f;
  }
}

}  // namespace

// The joints supply the momenta after the step, less those before it and all loads. trees.supply still holds
// the latter two.
void store_tree_reactions(const TreeSetting& in, const JointContexts& joints, std::span<const double> w,
                          const TreeStep& trees, State& state) {
  if (trees.slow)
    make_slow_momenta(in, trees.after, trees, in.memory.impulse);
  else
    make_momenta(in, trees.after, in.h, trees, in.memory.impulse);
  for (std::size_t i = 0; i < in.tree.moving().size(); ++i)
    in.memory.impulse[i] = in.memory.impulse[i] - trees.supply[i];
  add_reactions(in, joints, w, trees, state.joint_wrenches);
}

// In an impact bodies do not move: the change of their momenta is M_b times that of their velocities.
void add_tree_impacts(const TreeSetting& in, const JointContexts& joints, std::span<const double> w,
                      const ConstrainedBodies& masses, const TreeStep& trees,
                      std::vector<JointWrench>& wrenches) {
  const Tree& tree = in.tree;
  std::vector<double> change;
  for (const Index i : masses.body) change.insert(change.end(), w.begin() + 6 * i, w.begin() + 6 * (i + 1));
  masses.apply(change.data());
  in.memory.impulse.resize(tree.moving().size());
  for (std::size_t k = 0; k < masses.body.size(); ++k) {
    const Index body = masses.body[k], i = tree.number()[body];
    const double* v = &change[6 * k];
    const Vec3 p = in.model.body(body).mass * Vec3{v[0], v[1], v[2]};
    in.memory.impulse[i] = {p, in.frames[body].inertia * Vec3{v[3], v[4], v[5]} +
                                   cross(trees.places[i].centre - trees.places[i].reference, p)};
  }
  add_reactions(in, joints, w, trees, wrenches);
}

}  // namespace amontons
