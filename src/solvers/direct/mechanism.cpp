#include "solvers/direct/mechanism.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "amontons/base/policy.hpp"
#include "solvers/direct/policy.hpp"

namespace amontons {

// The analysis is repeated if bodies, trees or links differ from the last call. Places and masses do not
// matter: a moving mechanism keeps its pattern. A different order of the joints is a different pattern.
void Mechanism::analyse(const Problem& problem, Scope scope) {
  const auto& A = std::get<ContactSystem>(problem.A);
  moves_.resize(A.bodies.size());
  for (std::size_t i = 0; i < moves_.size(); ++i)
    moves_[i] = scope == Scope::all && A.bodies.moves(static_cast<Index>(i));
  row_.clear();
  link_.clear();
  P_.clear();
  for (const SetRun& run : problem.K.runs()) {
    if (run.kind != kind_of<Bilateral>) continue;
    for (std::size_t i = 0; i < run.count; ++i) {
      const ContactGraph::Link& link = problem.graph.links[run.block + i];
      row_.push_back(run.row + i);
      link_.push_back({link.a, link.b});
      for (Index body : {link.a, link.b})
        if (body >= 0) moves_[body] = 1;
      P_.push_back(problem.P[run.block + i]);
    }
  }
  static const Linkage none;
  const Linkage& trees = linkage_of(A) ? *linkage_of(A) : none;
  const auto& [number, last, parent] = analysed_trees_;
  if (moves_ == analysed_moves_ && link_ == analysed_link_ && trees.number == number && trees.last == last &&
      trees.parent == parent)
    return;
  analyse_pattern(A);
  analysed_moves_ = moves_;
  analysed_link_ = link_;
  analysed_trees_ = {trees.number, trees.last, trees.parent};
}

// Rows in groups of at most six. Rows between the same two bodies form one, also if other rows lie between
// them in the problem. So do rows on the same tree or trees, whose pivots are dense in any case. They are
// sorted by the place where they end, so that a group has few coordinates.
void Mechanism::find_joints(const ContactSystem& A) {
  const Linkage* trees = linkage_of(A);
  // The node of a body, or of the root of its tree; then the coordinate where its rows end.
  const auto at = [&](Index body) -> std::pair<int, Index> {
    const Index in_tree = trees ? trees->number_of(body) : -1;
    if (in_tree < 0) return {body < 0 ? -1 : nodes_.of_body[body], -1};
    int root = -1;
    nodes_.visit_nodes(body, [&](int node) { root = node; });
    return {root, trees->last[in_tree]};
  };
  std::vector<std::array<Index, 4>> key;
  for (const Link& link : link_) {
    auto a = at(link.a), b = at(link.b);
    if (b < a) std::swap(a, b);
    // A row between a tree and the world is one of the tree.
    key.push_back({a.first < 0 && b.second >= 0 ? b.first : a.first, b.first, b.second, a.second});
  }
  std::vector<std::size_t> sorted(link_.size());
  std::iota(sorted.begin(), sorted.end(), std::size_t{0});
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](std::size_t i, std::size_t j) { return key[i] < key[j]; });
  joints_.clear();
  const std::array<Index, 4>* last = nullptr;
  for (const std::size_t i : sorted) {
    if (!last || joints_.back().rows.size() == width ||
        !std::equal(last->begin(), last->begin() + 2, key[i].begin()))
      joints_.push_back({{}, 0, 0});
    joints_.back().rows.push_back(i);
    last = &key[i];
  }
}

// Coordinates have positive pivots and joints negative ones. With known signs L S L' needs no exchange of
// rows in any order (Vanderbei 1995, quasidefinite matrices), so the order may minimise the fill.
void Mechanism::analyse_pattern(const ContactSystem& A) {
  using Node = QuasidefiniteFactor::Node;
  nodes_ = MotionNodes(A, moves_, false);
  std::vector<Node> nodes(nodes_.size.size(), Node::coordinates);
  for (const int node : nodes_.of_body)
    if (node >= 0) nodes[node] = Node::body;
  find_joints(A);
  edge_node_.clear();
  std::vector<QuasidefiniteFactor::Edge> edges;
  std::vector<unsigned char> met(nodes.size());
  for (Joint& joint : joints_) {
    joint.first = edges.size();
    std::fill(met.begin(), met.end(), 0);
    for (const std::size_t i : joint.rows)
      for (const Index body : {link_[i].a, link_[i].b})
        nodes_.visit_nodes(body, [&](int node) {
          if (std::exchange(met[node], 1)) return;
          edges.push_back({static_cast<Index>(nodes.size()), node});
          edge_node_.push_back(node);
        });
    joint.last = edges.size();
    nodes.push_back(Node::joint);
  }
  K_.analyse(nodes, edges);
  edge_of_.assign(nodes.size(), 0);
  nodes_.number_entries([this](int node) { return position(node); });
  last_node_.assign(moves_.size(), -1);
  for (std::size_t i = 0; i < last_node_.size(); ++i)
    if (nodes_.last[i] >= 0) last_node_[i] = position(nodes_.last[i]);
}

// A system with constrained bodies is itself the rest of another problem.
bool Mechanism::factor_held(const Problem& problem) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || A->constrained) return false;
  analyse(problem, Scope::held);
  return !row_.empty() && takes_little() && factor(problem);
}

// -E, the least pivots and the rows of Y of one joint. Unused rows of a node of six are -1 with zeros beside
// them: they constrain nothing, and their entries of solutions are not read.
void Mechanism::assemble_joint(const Problem& problem, std::size_t joint) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  const Joint& j = joints_[joint];
  for (std::size_t edge = j.first; edge < j.last; ++edge) edge_of_[position(edge_node_[edge])] = edge;
  double *E = K_.diagonal(node_of_joint(joint)), *least = K_.least(node_of_joint(joint));
  for (std::size_t k = 0; k < j.rows.size(); ++k) {
    const std::size_t row = row_[j.rows[k]];
    E[(width + 1) * k] = -A.compliance[row - contact_rows];
    least[k] = base::policy.rounding * P_[j.rows[k]];
    nodes_.visit_row(A, row, A.jacobian[row - contact_rows], [&](std::size_t at, double value) {
      const std::size_t edge = edge_of_[at / width], i = at % width;
      K_.block(edge)[K_.a_first(edge) ? width * k + i : width * i + k] = value;
    });
  }
}

bool Mechanism::factor(const Problem& problem) {
  nodes_.make_roots(std::get<ContactSystem>(problem.A).bodies);
  if (joints_.empty()) return true;
  K_.clear();
  for (std::size_t j = 0; j < joints_.size(); ++j) assemble_joint(problem, j);
  return K_.factor();
}

void Mechanism::right_side(std::span<const double> u, std::vector<double>& r) const {
  r.assign(width * K_.nodes(), 0.0);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    double* to = &r[width * static_cast<std::size_t>(K_.position(node_of_joint(j)))];
    for (std::size_t i : joints_[j].rows) *to++ = -u[row_[i]];
  }
}

void Mechanism::solve(std::vector<double>& z) const {
  K_.forward(z.data());
  K_.backward(z.data());
}

// v of K (v, -x_f) = (w, 0): joints react to w as in the whole problem. b_f = 0, because the result is only
// the change of the velocities.
void Mechanism::move(const Bodies& bodies, const std::vector<Index>& body, double* w,
                     std::vector<double>& z) const {
  z.assign(width * K_.nodes(), 0.0);
  for (std::size_t i = 0; i < body.size(); ++i)
    nodes_.to_node(bodies, static_cast<std::size_t>(body[i]), w + width * i, &z[width * last_node_[body[i]]]);
  solve(z);
  for (std::size_t i = 0; i < body.size(); ++i)
    nodes_.to_body(bodies, static_cast<std::size_t>(body[i]), &z[width * last_node_[body[i]]], w + width * i);
}

// K (v, -x_f) = (C'D_c' x_c, -b_f)
void Mechanism::hold(const Problem& problem, std::span<double> x, std::vector<double>& w,
                     std::vector<double>& z) const {
  const auto& A = std::get<ContactSystem>(problem.A);
  for (std::size_t row : row_) x[row] = 0;
  w.assign(width * A.bodies.size(), 0.0);
  amontons::add_impulses(A, x, w);
  right_side(problem.b, z);
  for (std::size_t i = 0; i < last_node_.size(); ++i)
    if (last_node_[i] >= 0) nodes_.to_node(A.bodies, i, &w[width * i], &z[width * last_node_[i]]);
  solve(z);
  add_impulses(z, x);
}

// K (v, -dx_f) = (0, -u_f): impulses that make u_f zero, including their effect on the mechanism's bodies.
void Mechanism::correct(std::span<const double> u, std::span<double> x, std::vector<double>& z) const {
  right_side(u, z);
  solve(z);
  add_impulses(z, x);
}

// Solutions hold -x_f.
void Mechanism::add_impulses(std::span<const double> z, std::span<double> x) const {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const double* from = &z[width * static_cast<std::size_t>(K_.position(node_of_joint(j)))];
    for (std::size_t i : joints_[j].rows) x[row_[i]] -= *from++;
  }
}

}  // namespace amontons
