#pragma once
#include <array>
#include <span>
#include <vector>

#include "amontons/problem/contact_graph.hpp"
#include "amontons/problem/linkage.hpp"
#include "solvers/linear/small_roots.hpp"

namespace amontons {

// The nodes of a factorisation in coordinates of motion: groups of at most six. They are those of a free body
// that moves, or coordinates of a tree that follow each other without a branch. M^-1 = C C' has a column of C
// per coordinate. A row of D C has entries at few nodes: one per free body, and those between a body of a
// tree and the root.
struct MotionNodes {
  static constexpr std::size_t width = 6;  // entries of a node; the last ones may be empty

  std::vector<int> size;           // coordinates
  std::vector<Vec3> position;      // of one body of each (m); empty if positions are unknown
  std::vector<int> of_body;        // its node; -1: bodies of trees, and those that have none
  std::vector<int> of_coordinate;  // of the trees, likewise
  // Six entries per node: that of each coordinate of the trees, and the first one of each free body.
  std::vector<int> entry, entry_of_body;
  // The nodes that move a body are last[body], above[last[body]] and so on until -1: those from its last
  // coordinate to the root, or its own.
  std::vector<int> last, above;

  MotionNodes() = default;
  // Nodes for the free bodies for which moves[body] holds, and for all coordinates of trees or only for those
  // that rows reach.
  MotionNodes(const ContactSystem& A, std::span<const unsigned char> moves, bool only_reached);

  template <class Visit>
  void visit_nodes(Index body, const Visit& visit) const {
    for (int node = body < 0 ? -1 : last[body]; node >= 0; node = above[node]) visit(node);
  }

  // Numbers the entries by an order of the nodes.
  template <class Position>
  void number_entries(const Position& position_of);

  // C of the free bodies; rows need it.
  void make_roots(const Bodies& bodies);
  // Calls put(entry, value) for the entries of a row of D C, which is number `row` in A. The part of
  // trees was made with the problem (ContactSystem::renew), because P needs it, too.
  template <class Put>
  void visit_row(const ContactSystem& A, std::size_t row, const JacobianRow& D, const Put& put) const;
  // C'w and C v of a free body that has a node, six numbers each.
  void to_node(const Bodies& bodies, std::size_t body, const double* w, double* along) const;
  void to_body(const Bodies& bodies, std::size_t body, const double* along, double* v) const;

 private:
  void add_trees(const ContactSystem& A, bool only_reached);
  std::vector<std::array<double, 6>> root_;  // per body: of the inverse inertia
};

template <class Position>
void MotionNodes::number_entries(const Position& position_of) {
  const auto first = [&](int node) { return static_cast<int>(width) * static_cast<int>(position_of(node)); };
  for (std::size_t k = 0; k < entry.size(); ++k)
    if (of_coordinate[k] >= 0) entry[k] = first(of_coordinate[k]) + entry[k] % static_cast<int>(width);
  entry_of_body.assign(of_body.size(), -1);
  for (std::size_t i = 0; i < of_body.size(); ++i)
    if (of_body[i] >= 0) entry_of_body[i] = first(of_body[i]);
}

template <class Put>
void MotionNodes::visit_row(const ContactSystem& A, std::size_t row, const JacobianRow& D,
                            const Put& put) const {
  if (!A.half.first.empty())
    for (std::size_t k = A.half.first[row]; k < A.half.first[row + 1]; ++k)
      put(static_cast<std::size_t>(entry[A.half.coordinate[k]]), A.half.value[k]);
  const auto put_free = [&](Index body, const std::array<double, 6>& j) {
    if (body < 0 || of_body[body] < 0) return;
    double own[width];
    to_node(A.bodies, static_cast<std::size_t>(body), j.data(), own);
    const auto first = static_cast<std::size_t>(entry_of_body[body]);
    for (std::size_t k = 0; k < width; ++k) put(first + k, own[k]);
  };
  put_free(D.body_a, D.a);
  put_free(D.body_b, D.b);
}

}  // namespace amontons
