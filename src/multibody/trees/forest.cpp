// This file selects the joints that need no rows. The spanning tree is that of the generalised coordinates
// (kinematics/tree). A joint with compliance in its locked directions is a spring and has rows. The bodies
// beyond it are a tree of their own, with a floating base. A body without joints of a tree stays free: its
// block of M^-1 is six by six, and its rotation keeps energy and momentum by itself (bodies/motion).
#include "multibody/trees/forest.hpp"

#include <algorithm>

namespace amontons {

namespace {

// The spanning tree of each mechanism, cut at joints that stay rows.
class Planter {
 public:
  explicit Planter(const Tree& tree) : tree_(tree), model_(tree.model()), children_(tree.links().size() + 1) {
    find_mechanisms();
    for (const std::size_t k : tree.order()) {
      const Link& link = tree.links()[k];
      const Index parent = is_in_tree(link) ? tree.link_of(link.parent) : -1;
      children_[parent < 0 ? tree.links().size() : static_cast<std::size_t>(parent)].push_back(k);
    }
  }

  Forest plant() {
    forest_.number.assign(model_.bodies(), -1);
    forest_.has_joint.assign(model_.joints(), 0);
    for (const std::size_t root : children_.back()) {
      const Link& link = tree_.links()[root];
      // A body without joints of a tree is a free body.
      if (is_in_tree(link) || !children_[root].empty()) place(root, -1, -1);
    }
    return std::move(forest_);
  }

 private:
  // Whether the joint that places a link belongs to a tree of the step.
  bool is_in_tree(const Link& link) const {
    return link.joint >= 0 && model_.joint(link.joint).compliance == 0 && !dense_[mechanism(link.body)];
  }

  // The first link of a mechanism names it; the last number is for bodies that do not move.
  std::size_t mechanism(Index body) const {
    const Index k = tree_.link_of(body);
    return k < 0 ? dense_.size() - 1 : root_[k];
  }

  // Mechanisms are connected by joints of the tree and by those that close loops. Their joints are counted.
  void find_mechanisms() {
    const std::size_t n = tree_.links().size();
    root_.resize(n);
    for (const std::size_t k : tree_.order()) {
      const Index parent = tree_.link_of(tree_.links()[k].parent);
      root_[k] = parent < 0 ? k : root_[parent];
    }
    std::vector<std::size_t> in_tree(n + 1, 0), loops(n + 1, 0);
    dense_.assign(n + 1, 0);
    for (std::size_t k = 0; k < n; ++k) in_tree[root_[k]] += tree_.links()[k].joint >= 0;
    for (const Index j : tree_.loops()) {
      const Joint& joint = model_.joint(j);
      ++loops[mechanism(model_.is_dynamic(joint.body_a) ? joint.body_a : joint.body_b)];
    }
    for (std::size_t k = 0; k < n; ++k) dense_[k] = loops[k] > in_tree[k];
  }

  // Depth first: the coordinates of a branch are adjacent. `above` is the last coordinate that moves the
  // parent. The coordinates of one joint follow each other like joints, each on top of the one before.
  void place(std::size_t k, Index above, Index root) {
    const Link& link = tree_.links()[k];
    TreeBody b;
    b.body = link.body;
    const auto number = static_cast<Index>(forest_.bodies.size());
    b.root = root < 0 ? number : root;
    b.first = forest_.parent.size();
    if (is_in_tree(link)) {
      b.parent = link.parent;
      b.above = b.parent < 0 ? -1 : forest_.number[b.parent];
      b.joint = link.joint;
      b.reversed = link.reversed;
      b.dofs = model_.joint(link.joint).dofs.size();
      b.first_dof = model_.first_dof(link.joint);
      const Joint& joint = model_.joint(link.joint);
      b.fore = link.reversed ? joint.frame_a : joint.frame_b;
      b.aft = inverse(link.reversed ? joint.frame_b : joint.frame_a);
      forest_.has_joint[link.joint] = 1;
    }
    b.count = b.joint < 0 ? 6 : link.v;
    forest_.number[b.body] = number;
    for (std::size_t i = 0; i < b.count; ++i) {
      forest_.parent.push_back(above);
      above = static_cast<Index>(forest_.parent.size()) - 1;
    }
    b.last = above;
    forest_.bodies.push_back(b);
    for (const std::size_t child : children_[k]) place(child, above, b.root);
  }

  const Tree& tree_;
  const Model& model_;
  std::vector<std::vector<std::size_t>> children_;  // of each link; last: roots
  std::vector<std::size_t> root_;
  std::vector<unsigned char> dense_;  // per mechanism: most of its joints close loops
  Forest forest_;
};

}  // namespace

// Joints of the tree of a mechanism without loops, as of a robot, never have rows. With loops it depends on
// their number. In a lattice, which has two joints per body and more, a tree would save less than half of the
// rows, and each product would go through it.
Forest make_forest(const Tree& tree) {
  if (tree.model().description().trees == Trees::none) return {};
  return Planter(tree).plant();
}

}  // namespace amontons
