#include "amontons/multibody/kinematics/tree.hpp"

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
}

// Depth first from the ground, then from the first body of each group that is not connected to the ground. So
// the links of a branch follow each other, as the step wants their coordinates (trees/forest).
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

}  // namespace amontons
