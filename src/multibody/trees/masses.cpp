// M of the trees by composite inertias. Its factors have no fill (problem/linkage). To make them in each step
// takes less time than to update those of the step before.
#include "multibody/trees/masses.hpp"

#include "multibody/joints/row_terms.hpp"

namespace amontons {

namespace {

// The parts of a linkage that no step changes: which coordinate moves which body, and where the rows of M
// lie. A row has one entry per coordinate on the way to the root, itself included, that is as many as it is
// deep.
void start_linkage(const Model& model, const Tree& tree, Linkage& linkage) {
  linkage.number.assign(model.bodies(), -1);
  for (std::size_t i = 0; i < model.bodies(); ++i) {
    if (tree.number()[i] < 0) continue;
    linkage.number[i] = static_cast<Index>(linkage.body.size());
    linkage.body.push_back(static_cast<Index>(i));
    linkage.last.push_back(tree.moving()[tree.number()[i]].last);
  }
  linkage.arm.resize(linkage.body.size());
  linkage.parent = tree.parent();
  for (std::size_t k = 0; k < tree.parent().size(); ++k) {
    const bool follows = k > 0 && tree.parent()[k] == static_cast<Index>(k) - 1;
    linkage.run.push_back(follows ? linkage.run.back() + 1 : 1);
  }
  linkage.column.resize(tree.parent().size());
  linkage.first.assign(1, 0);
  std::vector<std::size_t> depth(tree.parent().size());
  for (std::size_t k = 0; k < depth.size(); ++k) {
    depth[k] = 1 + (tree.parent()[k] < 0 ? 0 : depth[tree.parent()[k]]);
    linkage.first.push_back(linkage.first.back() + depth[k]);
  }
  linkage.rows.resize(linkage.first.back());
}

// A linkage that no problem holds any more. The simulation keeps two problems, the last one and the memory of
// the one before, so that the pool has three entries unless a user keeps problems.
std::shared_ptr<ConstrainedBodies> unused_linkage(const TreeSetting& in) {
  for (const auto& known : in.memory.pool)
    if (known.use_count() == 1) return known;
  const auto linkage = std::make_shared<Linkage>();
  start_linkage(in.model, in.tree, *linkage);
  auto fresh = std::make_shared<ConstrainedBodies>(
      ConstrainedBodies{linkage->body, [of = linkage.get()](double* w) { of->move(w); }, linkage});
  in.memory.pool.push_back(fresh);
  return fresh;
}

// Inertias about the reference by Steiner's theorem: I_O = R I R' + m (<c, c> 1 - c c').
void make_inertias(const Model& model, const Tree& tree, const BodyFrames& frames, TreeStep& trees) {
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const Index body = tree.moving()[i].body;
    const double m = model.body(body).mass;
    const Vec3 c = frames[body].centre - trees.places[i].reference;
    const double cc = dot(c, c);
    SpatialInertia& inertia = trees.inertias[i];
    inertia = {m, m * c, frames[body].inertia};
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 3; ++k) inertia.second(r, k) += m * ((r == k ? cc : 0) - c[r] * c[k]);
  }
}

// Spring, damper and drive of a coordinate, with the impulse of a row (drive_terms). On the diagonal of M is
// its derivative.
void make_drives(const Model& model, const Tree& tree, const State& state, TreeStep& trees) {
  for (const TreeBody& b : tree.moving()) {
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

void make_tree_masses(const TreeSetting& in, const State& state, TreeStep& trees) {
  if (!in.tree.moves()) return;
  make_inertias(in.model, in.tree, in.frames, trees);
  make_drives(in.model, in.tree, state, trees);
  trees.constrained.reset();
  trees.constrained = tree_masses(in, in.h > 0, trees);
}

// Composite inertias. Let I be the inertia of all bodies that a body supports. A unit of its column s gives
// the momentum I s. So M = <s', I s> for the columns s' on the way to the root (Featherstone 2008, ch. 6.2).
//
// Bodies come after their parents in the list. From the last one to the first, the inertia of a body is
// complete before it is added to that of its parent. Reference points are those of the tree: inertias add.
std::shared_ptr<ConstrainedBodies> tree_masses(const TreeSetting& in, bool with_drives, TreeStep& trees) {
  const Tree& tree = in.tree;
  auto masses = unused_linkage(in);
  Linkage& linkage = const_cast<Linkage&>(*masses->linkage);  // no problem holds it
  for (std::size_t i = 0; i < tree.moving().size(); ++i) {
    const TreePlace& place = trees.places[i];
    linkage.arm[linkage.number[tree.moving()[i].body]] = place.centre - place.reference;
  }
  for (std::size_t k = 0; k < tree.parent().size(); ++k) {
    const Flow& s = trees.columns[k];
    linkage.column[k] = {s.linear.x, s.linear.y, s.linear.z, s.angular.x, s.angular.y, s.angular.z};
  }
  in.memory.carried = trees.inertias;
  if (with_drives)
    for (std::size_t i = 0; !trees.stiffness.empty() && i < tree.moving().size(); ++i)
      in.memory.carried[i].second = in.memory.carried[i].second + trees.stiffness[tree.moving()[i].body];
  for (std::size_t i = tree.moving().size(); i-- > 0;) {
    const TreeBody& b = tree.moving()[i];
    const SpatialInertia& inertia = in.memory.carried[i];
    for (std::size_t k = b.first; k < b.first + b.count; ++k) {
      const Flow momentum = momentum_of(inertia, trees.columns[k]);
      double* row = &linkage.rows[linkage.first[k]];
      for (auto above = static_cast<Index>(k); above >= 0; above = tree.parent()[above])
        *row++ = power(momentum, trees.columns[above]);
      TreeDrive& drive = trees.drives[k];
      double& diagonal = linkage.rows[linkage.first[k]];
      diagonal += drive.inertia;
      if (!with_drives) continue;
      drive.euler = euler_share(drive.stiffness, drive.damping, 1 / diagonal, in.h);
      const DriveShares share = drive_shares(in.h, in.last, drive.euler);
      diagonal += in.kick() * (drive.damping * share.rate_after + drive.stiffness * share.stretch_after);
    }
    if (b.above >= 0) in.memory.carried[b.above] += inertia;
  }
  linkage.factor();
  return masses;
}

}  // namespace amontons
