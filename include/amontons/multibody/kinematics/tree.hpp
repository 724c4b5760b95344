#pragma once
#include <memory>
#include <vector>

#include "amontons/multibody/model/model.hpp"

// Generalised coordinates: a spanning tree of the joints places all bodies, the other joints close loops.
// They serve users for queries and settings. A step moves those bodies in them whose joints need no rows.
namespace amontons {

// How one dynamic body is connected to the tree: by a joint, or not at all (a floating base).
struct Link {
  Index body = world;
  Index parent = world;   // body relative to which it moves; world for a floating base
  Index joint = -1;       // -1: a floating base
  bool reversed = false;  // the body is B of the joint: its coordinates move the parent against the body
  // Its entries in q and qd. For a joint: those of its dofs in their order. A ball joint adds a unit
  // quaternion (w, x, y, z), the rotation of frame_a from its place after the dofs, and three angular
  // velocities of A relative to B in the axes of frame_a. For a floating base: position of the body frame's
  // origin and its orientation, velocity of the origin in world axes and angular velocity in body axes.
  std::size_t first_q = 0, q = 0, first_v = 0, v = 0;
};

// A body that a step moves in coordinates of its joints: moved by a joint relative to its parent, or freely
// (the base of a floating tree). Its coordinates are the dofs of the joint in their order, then three of a
// ball. Those of a base are the displacement of its centre of mass and a turn about it, in world axes.
struct TreeBody {
  Index body = world, parent = world;          // parent: another body of a tree, a driven body, or the world
  Index above = -1;                            // number of the parent among the bodies of trees
  Index joint = -1;                            // -1: a base
  bool reversed = false;                       // the body is B of the joint
  std::size_t first = 0, dofs = 0, count = 0;  // its coordinates; `dofs` of them are dofs of the joint
  std::size_t first_dof = 0;                   // in State::coordinates
  Transform fore, aft;  // on the parent and on the body: frames of the joint, the latter inverted
  Index root = -1;      // number of the first TreeBody of its tree
  Index last = -1;      // the last coordinate that moves it; -1: none
};

class Tree {
 public:
  // A joint is part of the tree unless earlier joints connect its bodies already, it is marked as closing a
  // loop, or it keeps a distance. Immobile bodies are part of the world. In each group of bodies without a
  // joint to the world the first body is the floating base.
  explicit Tree(std::shared_ptr<const Model> model);

  const Model& model() const { return *model_; }
  // One per dynamic body, in the order of the bodies; the entries of q and qd have the same order.
  const std::vector<Link>& links() const { return links_; }
  // Indices of links, parents before children.
  const std::vector<std::size_t>& order() const { return order_; }
  // Index of the link of a body, -1 if it is not dynamic.
  Index link_of(Index body) const { return body < 0 ? -1 : link_of_[body]; }
  // Joints outside the tree that can move a body.
  const std::vector<Index>& loops() const { return loops_; }
  // Rigid ones of them between bodies that move freely, except in lattices.
  const std::vector<Index>& loops_of_rows() const { return loops_of_rows_; }
  std::size_t nq() const { return nq_; }
  std::size_t nv() const { return nv_; }

  // The bodies that a step moves in these coordinates, parents before children and each branch in one piece:
  // those with a joint that belongs to a tree. Empty unless Model(trees="auto").
  const std::vector<TreeBody>& moving() const { return moving_; }
  bool moves() const { return !moving_.empty(); }
  bool moves(std::size_t body) const { return moves() && number_[body] >= 0; }
  // Per body of the model its TreeBody, -1 outside of trees; empty if none moves, as are the next two.
  const std::vector<Index>& number() const { return number_; }
  // Per joint: it belongs to a tree, and locks nothing by rows.
  const std::vector<unsigned char>& without_rows() const { return without_rows_; }
  // Per coordinate of the step, as in Linkage.
  const std::vector<Index>& parent() const { return parent_; }

 private:
  void order_links(const std::vector<std::vector<Index>>& joints_of);
  void number_coordinates();
  std::vector<unsigned char> find_lattices() const;
  void find_moving(const std::vector<unsigned char>& is_lattice);
  void find_loops_of_rows(const std::vector<unsigned char>& is_lattice);

  std::shared_ptr<const Model> model_;
  std::vector<Link> links_;
  std::vector<std::size_t> order_;
  std::vector<Index> link_of_, loops_, loops_of_rows_, number_, parent_;
  std::vector<TreeBody> moving_;
  std::vector<unsigned char> without_rows_;
  std::size_t nq_ = 0, nv_ = 0;
};

}  // namespace amontons
