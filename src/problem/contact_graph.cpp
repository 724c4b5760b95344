#include "amontons/problem/contact_graph.hpp"

#include <algorithm>
#include <numeric>

#include "amontons/problem/linkage.hpp"

namespace amontons {

// The node of each body: a tree is that of its first body. A link that is welded to the world has the last
// node, which no impulse moves.
static void make_nodes(const ContactSystem& A, std::vector<Index>& node) {
  const auto bodies = static_cast<Index>(A.bodies.size());
  node.resize(A.bodies.size() + 1);
  std::iota(node.begin(), node.end(), 0);
  if (!A.constrained || !A.constrained->linkage) return;
  const Linkage& trees = *A.constrained->linkage;
  static thread_local std::vector<Index> tree, first;
  tree.resize(trees.coordinates());
  first.assign(trees.coordinates(), -1);
  for (std::size_t k = 0; k < tree.size(); ++k)
    tree[k] = trees.parent[k] < 0 ? static_cast<Index>(k) : tree[trees.parent[k]];
  for (std::size_t i = 0; i < trees.body.size(); ++i) {
    if (trees.last[i] >= 0 && first[tree[trees.last[i]]] < 0) first[tree[trees.last[i]]] = trees.body[i];
    node[trees.body[i]] = trees.last[i] < 0 ? bodies : first[tree[trees.last[i]]];
  }
}

// An impulse on a body of a tree moves all of it: M of trees has blocks for whole trees. So A is block
// diagonal over islands only if each tree belongs to one, whichever of its bodies the blocks act on.
//
// Union-find over the nodes, with one more for blocks without a moving body, which no other block influences.
// Paths are halved on the way to the root. The world joins nothing: bodies side by side on the ground are
// separate islands.
static void find_islands(const ContactSystem& A, ContactGraph& graph) {
  static thread_local std::vector<Index> parent, number;  // kept: a step at rest allocates nothing
  make_nodes(A, parent);
  const auto ground = static_cast<Index>(graph.bodies());
  const auto root = [ground](Index i) {
    if (i < 0) return ground;
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto of = [&](const ContactGraph::Link& link) {
    const Index a = root(link.a);
    return a == ground ? root(link.b) : a;
  };
  for (const ContactGraph::Link& link : graph.links)
    if (const Index a = root(link.a), b = root(link.b); a != ground && b != ground) parent[a] = b;
  // Numbers follow the first appearance of the islands, so they depend only on the order of the blocks.
  auto& [count, of_block, of_body] = graph.islands;
  number.assign(graph.bodies() + 1, -1);
  count = 0;
  of_block.resize(graph.links.size());
  for (std::size_t k = 0; k < of_block.size(); ++k) {
    Index& mine = number[of(graph.links[k])];
    if (mine < 0) mine = static_cast<Index>(count++);
    of_block[k] = mine;
  }
  number[ground] = -1;
  of_body.resize(graph.bodies());
  for (std::size_t i = 0; i < of_body.size(); ++i) of_body[i] = number[root(static_cast<Index>(i))];
}

// One link per block of K. All rows of a block act on the same bodies (check_blocks), so its first row gives
// them. Contacts come first and are blocks of their own.
void make_contact_graph(const ContactSystem& A, const SetProduct& K, ContactGraph& graph) {
  // Mark of a body that impulses move while no block acts on it yet.
  constexpr unsigned char untouched = 2;
  graph.moves.resize(A.bodies.size());
  graph.links.resize(K.blocks());
  graph.first_row.resize(K.blocks() + 1);
  for (std::size_t i = 0; i < graph.moves.size(); ++i)
    graph.moves[i] = A.bodies.moves(static_cast<Index>(i)) ? untouched : 0;
  // A body counts as moving once a block acts on it: an untouched body is no node.
  const auto node = [&](Index body) {
    if (body < 0 || !graph.moves[body]) return Index{-1};
    graph.moves[body] = 1;
    return body;
  };
  std::size_t contact_rows = 0;
  for_each_block(K, [&](const auto& set, std::size_t block, std::size_t row) {
    graph.first_row[block] = static_cast<Index>(row);
    if (block < A.contacts.size()) {
      const ContactGeometry& c = A.contacts[block];
      graph.links[block] = {node(c.body_a), node(c.body_b)};
      contact_rows = row + set.dim;
    } else {
      const JacobianRow& j = A.jacobian[row - contact_rows];
      graph.links[block] = {node(j.body_a), node(j.body_b)};
    }
  });
  graph.first_row.back() = static_cast<Index>(K.rows());
  std::replace(graph.moves.begin(), graph.moves.end(), untouched, static_cast<unsigned char>(0));
  find_islands(A, graph);
}

}  // namespace amontons
