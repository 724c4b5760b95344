// This file selects the joints that need no rows. The spanning tree is that of the generalised coordinates
// (kinematics/tree). A joint with compliance in its locked directions is a spring and has rows. The bodies
// beyond it are a tree of their own, with a floating base. A body without joints of a tree stays free: its
// block of M^-1 is six by six, and its rotation keeps energy and momentum by itself (bodies/motion).
#include "multibody/trees/forest.hpp"

#include <algorithm>

namespace amontons {

namespace {

// Per link of the tree, and for bodies that do not move: whether most joints of its mechanism close loops.
//
// Joints of the tree of a mechanism without loops, as of a robot, never have rows. With loops it depends on
// their number. In a lattice, which has two joints per body and more, a tree would save less than half of the
// rows, and each product would go through it.
std::vector<unsigned char> find_lattices(const Tree& tree) {
  const std::size_t n = tree.links().size();
  std::vector<std::size_t> first(n + 1, n);  // the first link of the mechanism
  std::vector<std::size_t> in_tree(n + 1, 0), loops(n + 1, 0);
  for (const std::size_t k : tree.order()) {
    const Index parent = tree.link_of(tree.links()[k].parent);
    first[k] = parent < 0 ? k : first[parent];
    in_tree[first[k]] += tree.links()[k].joint >= 0;
  }
  for (const Index j : tree.loops()) {
    const Joint& joint = tree.model().joint(j);
    const Index a = tree.link_of(joint.body_a), k = a < 0 ? tree.link_of(joint.body_b) : a;
    ++loops[first[k < 0 ? n : static_cast<std::size_t>(k)]];
  }
  std::vector<unsigned char> is_lattice(n);
  for (std::size_t k = 0; k < n; ++k) is_lattice[k] = loops[first[k]] > in_tree[first[k]];
  return is_lattice;
}

}  // namespace

// The coordinates of one joint follow each other like joints, each on top of the one before. Links come depth
// first, and beyond a joint that stays a row after all others: the coordinates of a branch are adjacent.
Forest make_forest(const Tree& tree) {
  const Model& model = tree.model();
  Forest forest;
  if (model.description().trees == Trees::none) return forest;
  const std::vector<unsigned char> is_lattice = find_lattices(tree);
  const auto& links = tree.links();
  const auto is_in_tree = [&](std::size_t k) {
    return links[k].joint >= 0 && model.joint(links[k].joint).compliance == 0 && !is_lattice[k];
  };
  std::vector<std::size_t> order = tree.order(), root(links.size());
  std::vector<unsigned char> bears(links.size(), 0);  // others of its tree
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t k = order[i];
    const Index parent = is_in_tree(k) ? tree.link_of(links[k].parent) : -1;
    root[k] = parent < 0 ? i : root[parent];
    if (parent >= 0) bears[parent] = 1;
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return root[a] < root[b]; });
  forest.number.assign(model.bodies(), -1);
  forest.has_joint.assign(model.joints(), 0);
  for (const std::size_t k : order) {
    const Link& link = links[k];
    // A body without joints of a tree is a free body.
    if (!is_in_tree(k) && !bears[k]) continue;
    TreeBody b;
    b.body = link.body;
    b.first = forest.parent.size();
    b.count = 6;
    if (is_in_tree(k)) {
      const Joint& joint = model.joint(link.joint);
      b.parent = link.parent;
      b.above = b.parent < 0 ? -1 : forest.number[b.parent];
      b.joint = link.joint;
      b.reversed = link.reversed;
      b.dofs = joint.dofs.size();
      b.count = link.v;
      b.first_dof = model.first_dof(link.joint);
      b.fore = link.reversed ? joint.frame_a : joint.frame_b;
      b.aft = inverse(link.reversed ? joint.frame_b : joint.frame_a);
      forest.has_joint[link.joint] = 1;
    }
    const auto number = static_cast<Index>(forest.bodies.size());
    forest.number[b.body] = number;
    b.root = b.above < 0 ? number : forest.bodies[b.above].root;
    b.last = b.above < 0 ? -1 : forest.bodies[b.above].last;
    for (std::size_t i = 0; i < b.count; ++i) {
      forest.parent.push_back(b.last);
      b.last = static_cast<Index>(forest.parent.size()) - 1;
    }
    forest.bodies.push_back(b);
  }
  return forest;
}

}  // namespace amontons
