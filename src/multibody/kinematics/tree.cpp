#include "amontons/multibody/kinematics/tree.hpp"

#include <algorithm>
#include <numeric>

#include "multibody/joints/chain.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

namespace {

// Groups of bodies that the joints so far connect (union-find with path halving). All immobile bodies share
// the last entry.
class Groups {
 public:
  explicit Groups(const Model& model) : model_(model), leader_(model.bodies() + 1) {
    std::iota(leader_.begin(), leader_.end(), std::size_t{0});
  }
  // False if they are in one group already.
  bool join(Index a, Index b) {
    const std::size_t i = find(a), j = find(b);
    leader_[i] = j;
    return i != j;
  }

 private:
  std::size_t find(Index body) {
    std::size_t i = model_.is_dynamic(body) ? static_cast<std::size_t>(body) : leader_.size() - 1;
    while (leader_[i] != i) i = leader_[i] = leader_[leader_[i]];
    return i;
  }

  const Model& model_;
  std::vector<std::size_t> leader_;
};

}  // namespace

// Earlier joints take precedence: files list the joints of their tree first.
Tree::Tree(std::shared_ptr<const Model> model) : model_(std::move(model)), link_of_(model_->bodies(), -1) {
  for (std::size_t i = 0; i < model_->bodies(); ++i) {
    if (!model_->is_dynamic(static_cast<Index>(i))) continue;
    link_of_[i] = static_cast<Index>(links_.size());
    links_.push_back({static_cast<Index>(i)});
  }
  Groups groups(*model_);
  std::vector<std::vector<Index>> joints_of(model_->bodies() + 1);  // of the tree; last: of the ground
  for (std::size_t j = 0; j < model_->joints(); ++j) {
    const Joint& joint = model_->joint(static_cast<Index>(j));
    if (!is_active(*model_, joint)) continue;
    if (joint.closes_loop || !is_chain(joint) || !groups.join(joint.body_a, joint.body_b)) {
      loops_.push_back(static_cast<Index>(j));
      continue;
    }
    for (const Index body : {joint.body_a, joint.body_b})
      joints_of[model_->is_dynamic(body) ? body : model_->bodies()].push_back(static_cast<Index>(j));
  }
  order_links(joints_of);
  number_coordinates();
  const std::vector<unsigned char> is_lattice = find_lattices();
  find_moving(is_lattice);
  find_loops_of_rows(is_lattice);
}

// Depth first from the ground, then from the first body of each group that is not connected to the ground. So
// the links of a branch follow each other, as the step wants their coordinates.
void Tree::order_links(const std::vector<std::vector<Index>>& joints_of) {
  std::vector<bool> placed(links_.size(), false);
  std::vector<Link> next;  // a stack
  // The bodies that a joint connects to this one (or to the ground).
  const auto add_children = [&](std::size_t body) {
    for (auto j = joints_of[body].rbegin(); j != joints_of[body].rend(); ++j) {
      const Joint& joint = model_->joint(*j);
      if (const Index a = link_of(joint.body_a); a >= 0 && !placed[a])
        next.push_back({joint.body_a, joint.body_b, *j, false});
      else if (const Index b = link_of(joint.body_b); b >= 0 && !placed[b])
        next.push_back({joint.body_b, joint.body_a, *j, true});
    }
  };
  add_children(model_->bodies());
  for (std::size_t first = 0; first <= links_.size(); ++first) {
    while (!next.empty()) {
      const Link link = next.back();
      next.pop_back();
      const Index k = link_of_[link.body];
      placed[k] = true;
      links_[k] = link;
      order_.push_back(static_cast<std::size_t>(k));
      add_children(static_cast<std::size_t>(link.body));
    }
    if (first < links_.size() && !placed[first]) next.push_back({links_[first].body});
  }
}

void Tree::number_coordinates() {
  for (Link& link : links_) {
    link.q = 7;
    link.v = 6;
    if (link.joint >= 0) {
      const Joint& joint = model_->joint(link.joint);
      const bool ball = joint.spherical || joint.kind == JointKind::distance;
      link.q = joint.dofs.size() + (ball ? 4 : 0);
      link.v = joint.dofs.size() + (ball ? 3 : 0);
    }
    link.first_q = nq_;
    link.first_v = nv_;
    nq_ += link.q;
    nv_ += link.v;
  }
}

// Per link of the tree, and for bodies that do not move: whether most joints of its mechanism close loops.
//
// Joints of the tree of a mechanism without loops, as of a robot, never have rows. With loops it depends on
// their number. In a lattice, which has two joints per body and more, a tree would save less than half of the
// rows, and each product would go through it.
std::vector<unsigned char> Tree::find_lattices() const {
  const std::size_t n = links_.size();
  std::vector<std::size_t> first(n + 1, n);  // the first link of the mechanism
  std::vector<std::size_t> in_tree(n + 1, 0), loops(n + 1, 0);
  for (const std::size_t k : order_) {
    const Index parent = link_of(links_[k].parent);
    first[k] = parent < 0 ? k : first[parent];
    in_tree[first[k]] += links_[k].joint >= 0;
  }
  for (const Index j : loops_) {
    const Joint& joint = model().joint(j);
    const Index a = link_of(joint.body_a), k = a < 0 ? link_of(joint.body_b) : a;
    ++loops[first[k < 0 ? n : static_cast<std::size_t>(k)]];
  }
  std::vector<unsigned char> is_lattice(n);
  for (std::size_t k = 0; k < n; ++k) is_lattice[k] = loops[first[k]] > in_tree[first[k]];
  return is_lattice;
}

// Takes the joints of the spanning tree that need no rows: their locked directions are rigid. A mechanism in
// which more joints close loops than belong to the tree keeps its rows, because there the form with rows is
// the smaller one. A joint with compliance in its locked directions is a spring and has rows. The bodies
// beyond it are a tree of their own, with a floating base. A body without joints of a tree stays free: its
// block of M^-1 is six by six, and its rotation keeps energy and momentum by itself (bodies/motion).
//
// The coordinates of one joint follow each other like joints, each on top of the one before. Links come depth
// first, and beyond a joint that stays a row after all others: the coordinates of a branch are adjacent.
void Tree::find_moving(const std::vector<unsigned char>& is_lattice) {
  const Model& model = *model_;
  if (model.description().trees == Trees::none) return;
  const auto is_in_tree = [&](std::size_t k) {
    return links_[k].joint >= 0 && model.joint(links_[k].joint).compliance == 0 && !is_lattice[k];
  };
  std::vector<std::size_t> order = order_, root(links_.size());
  std::vector<unsigned char> bears(links_.size(), 0);  // others of its tree
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t k = order[i];
    const Index parent = is_in_tree(k) ? link_of(links_[k].parent) : -1;
    root[k] = parent < 0 ? i : root[parent];
    if (parent >= 0) bears[parent] = 1;
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return root[a] < root[b]; });
  number_.assign(model.bodies(), -1);
  without_rows_.assign(model.joints(), 0);
  for (const std::size_t k : order) {
    const Link& link = links_[k];
    // A body without joints of a tree is a free body.
    if (!is_in_tree(k) && !bears[k]) continue;
    TreeBody b;
    b.body = link.body;
    b.first = parent_.size();
    b.count = 6;
    if (is_in_tree(k)) {
      const Joint& joint = model.joint(link.joint);
      b.parent = link.parent;
      b.above = b.parent < 0 ? -1 : number_[b.parent];
      b.joint = link.joint;
      b.reversed = link.reversed;
      b.dofs = joint.dofs.size();
      b.count = link.v;
      b.first_dof = model.first_dof(link.joint);
      b.fore = link.reversed ? joint.frame_a : joint.frame_b;
      b.aft = inverse(link.reversed ? joint.frame_b : joint.frame_a);
      without_rows_[link.joint] = 1;
    }
    const auto number = static_cast<Index>(moving_.size());
    number_[b.body] = number;
    b.root = b.above < 0 ? number : moving_[b.above].root;
    b.last = b.above < 0 ? -1 : moving_[b.above].last;
    for (std::size_t i = 0; i < b.count; ++i) {
      parent_.push_back(b.last);
      b.last = static_cast<Index>(parent_.size()) - 1;
    }
    moving_.push_back(b);
  }
}

void Tree::find_loops_of_rows(const std::vector<unsigned char>& is_lattice) {
  for (const Index j : loops_) {
    const Joint& joint = model_->joint(j);
    const Index a = link_of(joint.body_a), link = a < 0 ? link_of(joint.body_b) : a;
    const auto in_tree = [&](Index body) { return body >= 0 && moves(static_cast<std::size_t>(body)); };
    if (joint.compliance == 0 && !is_lattice[link] && !in_tree(joint.body_a) && !in_tree(joint.body_b))
      loops_of_rows_.push_back(j);
  }
}

}  // namespace amontons
