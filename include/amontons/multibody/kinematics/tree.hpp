#pragma once
#include <memory>
#include <vector>

#include "amontons/multibody/model/model.hpp"

// Generalised coordinates: a spanning tree of the joints places all bodies, the other joints close loops. The
// step knows nothing of it, as it works on bodies and joints alike; this is how users ask and set.
namespace amontons {

// How one dynamic body hangs on the tree: by a joint, or not at all (a floating base).
struct Link {
  Index body = world;
  Index parent = world;   // the body that it moves against; world for a floating base
  Index joint = -1;       // -1: a floating base
  bool reversed = false;  // the body is B of the joint: its coordinates move the parent against the body
  // Its entries in q and in qd: those of the joint's dofs in their order; of a ball joint then a unit
  // quaternion (w, x, y, z), the rotation of frame_a from where the dofs have put it, and three angular
  // velocities of A relative to B in the axes of frame_a. Of a floating base the position of the body frame's
  // origin and its orientation, the velocity of the origin in world axes and the angular velocity in body
  // axes.
  std::size_t first_q = 0, q = 0, first_v = 0, v = 0;
};

class Tree {
 public:
  // A joint is part of the tree unless those before it join its bodies already, it says that it closes a
  // loop, or it keeps a distance. Bodies that nothing moves are one with the world. Of bodies that no joint
  // leads to the world from, the first is the floating base.
  explicit Tree(std::shared_ptr<const Model> model);

  const Model& model() const { return *model_; }
  // One per dynamic body, in the order of the bodies; so are the entries of q and qd.
  const std::vector<Link>& links() const { return links_; }
  // Indices of links, parents before children.
  const std::vector<std::size_t>& order() const { return order_; }
  // Of a body, -1 if it is not dynamic.
  Index link_of(Index body) const { return body < 0 ? -1 : link_of_[body]; }
  // Joints that are not in the tree and can move a body.
  const std::vector<Index>& loops() const { return loops_; }
  std::size_t nq() const { return nq_; }
  std::size_t nv() const { return nv_; }

 private:
  void order_links(const std::vector<std::vector<Index>>& joints_of);
  void number_coordinates();

  std::shared_ptr<const Model> model_;
  std::vector<Link> links_;
  std::vector<std::size_t> order_;
  std::vector<Index> link_of_, loops_;
  std::size_t nq_ = 0, nv_ = 0;
};

}  // namespace amontons
