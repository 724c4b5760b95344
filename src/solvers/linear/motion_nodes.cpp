// A floating base is a node of six coordinates, as a free body is; an arm of seven hinges has nodes of six
// and of one. Rows that end within a node have zeros at its later coordinates. A node ends where the tree
// branches, because rows of one branch would have zeros for all of another one.
#include "solvers/linear/motion_nodes.hpp"

#include <cmath>
#include <utility>

namespace amontons {

MotionNodes::MotionNodes(const ContactSystem& A, std::span<const unsigned char> moves, bool only_reached)
    : of_body(moves.size(), -1) {
  const Linkage* trees = linkage_of(A);
  for (std::size_t i = 0; i < of_body.size(); ++i) {
    if (!moves[i] || (trees && trees->number_of(static_cast<Index>(i)) >= 0)) continue;
    of_body[i] = static_cast<int>(size.size());
    size.push_back(6);
    if (!A.bodies.centre.empty()) position.push_back(A.bodies.centre[i]);
  }
  last = of_body;
  above.assign(size.size(), -1);
  if (trees) add_trees(A, only_reached);
  number_entries([](int node) { return node; });
}

// Rows reach whole ways to the root, so that the parent of a coordinate that they reach has a node.
void MotionNodes::add_trees(const ContactSystem& A, bool only_reached) {
  const Linkage& trees = *A.constrained->linkage;
  const std::size_t first = size.size();
  std::vector<char> reached(trees.coordinates(), !only_reached);
  std::vector<int> children(trees.coordinates(), 0);
  for (const Index k : A.half.coordinate) reached[k] = 1;
  for (std::size_t k = 0; k < reached.size(); ++k)
    if (reached[k] && trees.parent[k] >= 0) ++children[trees.parent[k]];
  of_coordinate.assign(reached.size(), -1);
  entry.assign(reached.size(), 0);
  for (std::size_t k = 0; k < reached.size(); ++k) {
    if (!reached[k]) continue;
    const bool follows = trees.run[k] > 1 && children[k - 1] == 1 && size.back() < 6;
    if (!follows) {
      size.push_back(0);
      above.push_back(trees.parent[k] < 0 ? -1 : of_coordinate[trees.parent[k]]);
    }
    of_coordinate[k] = static_cast<int>(size.size()) - 1;
    entry[k] = size.back()++;
  }
  for (std::size_t i = 0; i < trees.body.size(); ++i)
    for (Index k = trees.last[i]; k >= 0 && last[trees.body[i]] < 0; k = trees.parent[k])
      last[trees.body[i]] = of_coordinate[k];
  if (A.bodies.centre.empty()) return;
  position.resize(size.size());
  std::vector<char> placed(size.size() - first, 0);
  for (const Index body : trees.body)
    visit_nodes(body, [&](int node) {
      if (!std::exchange(placed[node - first], 1)) position[node] = A.bodies.centre[body];
    });
}

void MotionNodes::make_roots(const Bodies& bodies) {
  root_.resize(of_body.size());
  for (std::size_t i = 0; i < of_body.size(); ++i)
    if (of_body[i] >= 0) root_[i] = semidefinite_root(bodies.inverse_inertia[i]);
}

void MotionNodes::to_node(const Bodies& bodies, std::size_t body, const double* w, double* along) const {
  times_root({w[0], w[1], w[2], w[3], w[4], w[5]}, std::sqrt(bodies.inverse_mass[body]), root_[body], along);
}

void MotionNodes::to_body(const Bodies& bodies, std::size_t body, const double* along, double* v) const {
  root_times(std::sqrt(bodies.inverse_mass[body]), root_[body], along, v);
}

}  // namespace amontons
