// A floating base is a node of six coordinates, as a free body is; an arm of seven hinges has nodes of six
// and of one. Rows that end within a node have zeros at its later coordinates. A node ends where the tree
// branches, because rows of one branch would have zeros for all of another one.
#include "solvers/linear/motion_nodes.hpp"

#include "amontons/problem/linkage.hpp"

namespace amontons {

MotionNodes::MotionNodes(const ContactSystem& A, const ContactGraph& graph) : of_body(graph.bodies(), -1) {
  const Linkage* trees = A.constrained ? A.constrained->linkage.get() : nullptr;
  for (std::size_t i = 0; i < of_body.size(); ++i) {
    if (!graph.moves[i] || (trees && trees->place_of(static_cast<Index>(i)) >= 0)) continue;
    of_body[i] = static_cast<int>(size.size());
    size.push_back(6);
    if (!A.bodies.centre.empty()) position.push_back(A.bodies.centre[i]);
  }
  if (trees) add_trees(A);
}

// Rows reach whole ways to the root, so that the parent of a coordinate that they reach has a node.
void MotionNodes::add_trees(const ContactSystem& A) {
  const Linkage& trees = *A.constrained->linkage;
  const std::size_t first = size.size();
  std::vector<char> reached(trees.coordinates(), 0);
  std::vector<int> children(trees.coordinates(), 0);
  for (const Index k : A.half.coordinate) reached[k] = 1;
  for (std::size_t k = 0; k < reached.size(); ++k)
    if (reached[k] && trees.parent[k] >= 0) ++children[trees.parent[k]];
  of_coordinate.assign(reached.size(), -1);
  place.assign(reached.size(), 0);
  for (std::size_t k = 0; k < reached.size(); ++k) {
    if (!reached[k]) continue;
    const bool follows = trees.run[k] > 1 && children[k - 1] == 1 && size.back() < 6;
    if (!follows) size.push_back(0);
    of_coordinate[k] = static_cast<int>(size.size()) - 1;
    place[k] = size.back()++;
  }
  if (A.bodies.centre.empty()) return;
  position.resize(size.size());
  std::vector<char> placed(size.size() - first, 0);
  for (std::size_t i = 0; i < trees.body.size(); ++i)
    for (Index k = trees.last[i]; k >= 0; k = trees.parent[k]) {
      const int node = of_coordinate[k];
      if (node < 0) continue;
      if (placed[node - first]) break;
      placed[node - first] = 1;
      position[node] = A.bodies.centre[trees.body[i]];
    }
}

}  // namespace amontons
