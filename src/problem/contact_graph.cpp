#include "amontons/problem/contact_graph.hpp"

#include <algorithm>
#include <numeric>

#include "amontons/problem/linkage.hpp"

namespace amontons {

// Ties each body of a tree to the first of its tree. Bodies that are welded to the world have no coordinate.
static void tie_trees(const Linkage& trees, std::vector<ContactGraph::Link>& ties) {
  static thread_local std::vector<Index> tree, first;
  tree.resize(trees.coordinates());
  first.assign(trees.coordinates(), -1);
  for (std::size_t k = 0; k < tree.size(); ++k)
    tree[k] = trees.parent[k] < 0 ? static_cast<Index>(k) : tree[trees.parent[k]];
  for (std::size_t i = 0; i < trees.body.size(); ++i) {
    if (trees.last[i] < 0) continue;
    Index& leader = first[tree[trees.last[i]]];
    if (leader < 0)
      leader = trees.body[i];
    else
      ties.push_back({leader, trees.body[i]});
  }
}

// One link per block of K. All rows of a block act on the same bodies (check_blocks), so its first row gives
// them. Contacts come first and are blocks of their own.
void make_contact_graph(const ContactSystem& A, const SetProduct& K, ContactGraph& graph) {
  // Mark of a body that impulses move while no block acts on it yet.
  constexpr unsigned char untouched = 2;
  graph.moves.resize(A.bodies.size());
  graph.links.clear();
  graph.ties.clear();
  if (A.constrained && A.constrained->linkage) tie_trees(*A.constrained->linkage, graph.ties);
  graph.first_row.clear();
  graph.links.reserve(K.blocks());
  graph.first_row.reserve(K.blocks() + 1);
  for (std::size_t i = 0; i < graph.moves.size(); ++i)
    graph.moves[i] = A.bodies.moves(static_cast<Index>(i)) ? untouched : 0;
  // A body counts as moving once a block acts on it: an untouched body is no node.
  const auto node = [&](Index body) {
    if (body < 0 || !graph.moves[body]) return Index{-1};
    graph.moves[body] = 1;
    return body;
  };
  std::size_t contact = 0;
  const std::size_t contact_rows = A.contact_rows();
  for_each_block(K, [&](const auto&, std::size_t, std::size_t row) {
    graph.first_row.push_back(static_cast<Index>(row));
    if (row < contact_rows) {
      const Contact& c = A.contacts[contact++];
      graph.links.push_back({node(c.body_a), node(c.body_b)});
    } else {
      const JacobianRow& j = A.jacobian[row - contact_rows];
      graph.links.push_back({node(j.body_a), node(j.body_b)});
    }
  });
  graph.first_row.push_back(static_cast<Index>(K.rows()));
  std::replace(graph.moves.begin(), graph.moves.end(), untouched, static_cast<unsigned char>(0));
}

ContactGraph contact_graph(const ContactSystem& A, const SetProduct& K) {
  ContactGraph graph;
  make_contact_graph(A, K, graph);
  return graph;
}

// An impulse on a body of a tree moves all of it: M of trees has blocks for whole trees. So A is block
// diagonal over islands only if each tree belongs to one, whichever of its bodies the blocks act on.
//
// Union-find over the bodies, with one more node for blocks without a moving body, which no other block
// influences. Paths are halved on the way to the root. The world joins nothing: bodies side by side on the
// ground are separate islands.
std::size_t find_islands(const ContactGraph& graph, std::vector<Index>& island) {
  const std::size_t bodies = graph.bodies();
  static thread_local std::vector<Index> parent, number;  // kept: a step at rest allocates nothing
  parent.resize(bodies + 1);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index body) {
    Index i = body < 0 ? static_cast<Index>(bodies) : body;
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const ContactGraph::Link& link : graph.links)
    if (link.a >= 0 && link.b >= 0) parent[root(link.a)] = root(link.b);
  for (const ContactGraph::Link& tie : graph.ties) parent[root(tie.a)] = root(tie.b);
  // Numbers follow the first appearance of the islands, so they depend only on the order of the blocks.
  number.assign(bodies + 1, -1);
  Index count = 0;
  island.resize(graph.links.size());
  for (std::size_t k = 0; k < island.size(); ++k) {
    const ContactGraph::Link& link = graph.links[k];
    Index& mine = number[root(link.a >= 0 ? link.a : link.b)];
    if (mine < 0) mine = count++;
    island[k] = mine;
  }
  return static_cast<std::size_t>(count);
}

}  // namespace amontons
