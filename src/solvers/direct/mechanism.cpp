#include "solvers/direct/mechanism.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solvers/direct/policy.hpp"
#include "solvers/second_order/policy.hpp"

namespace amontons {

namespace {

constexpr int n = QuasidefiniteFactor::width;

// Inverts the symmetric matrix xx, yy, zz, xy, xz, yz by cofactors, in the same order. False if it is
// singular.
bool invert(const std::array<double, 6>& s, double (&out)[6]) {
  const auto& [xx, yy, zz, xy, xz, yz] = s;
  const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
  const double det = xx * a + xy * b + xz * c;
  if (!(det > 0)) return false;
  const double inverse[6] = {a, xx * zz - xz * xz, xx * yy - xy * xy, b, c, xy * xz - xx * yz};
  for (int k = 0; k < 6; ++k) out[k] = inverse[k] / det;
  return std::isfinite(out[0] + out[1] + out[2]);
}

// False for a point mass, and for a body that moves along lines only.
bool turns(const Bodies& bodies, std::size_t body) {
  const auto& I = bodies.inverse_inertia[body];
  return std::any_of(I.begin(), I.end(), [](double v) { return v != 0; });
}

}  // namespace

void keep_moving(const Bodies& bodies, std::size_t body, std::array<double, 6>& d) {
  if (bodies.inverse_mass[body] == 0) std::fill_n(d.begin(), 3, 0.0);
  if (!turns(bodies, body)) std::fill_n(d.begin() + 3, 3, 0.0);
}

// The analysis is repeated if bodies or links differ from the last call. Places and masses do not matter: a
// moving mechanism keeps its pattern. A different order of the joints is a different pattern.
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
  if (moves_ != analysed_moves_ || link_ != analysed_link_) analyse_pattern();
}

// Bodies have positive pivots and joints negative ones. With known signs L S L' needs no exchange of rows in
// any order (Vanderbei 1995, quasidefinite matrices), so the order may minimise the fill.
//
// Nodes: bodies that move, then joints. All rows between the same two bodies share nodes, also if other rows
// lie between them in the problem.
void Mechanism::analyse_pattern() {
  node_.assign(moves_.size(), -1);
  std::vector<signed char> sign;
  for (std::size_t i = 0; i < moves_.size(); ++i)
    if (moves_[i]) {
      node_[i] = static_cast<Index>(sign.size());
      sign.push_back(1);
    }
  std::vector<std::size_t> sorted(link_.size());
  std::iota(sorted.begin(), sorted.end(), std::size_t{0});
  const auto bodies = [](const Link& link) {
    return std::pair(std::min(link.a, link.b), std::max(link.a, link.b));
  };
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](std::size_t i, std::size_t j) { return bodies(link_[i]) < bodies(link_[j]); });
  joints_.clear();
  for (std::size_t i : sorted) {
    if (joints_.empty() || joints_.back().rows.size() == width ||
        bodies(joints_.back().link) != bodies(link_[i]))
      joints_.push_back({link_[i], {}});
    joints_.back().rows.push_back(i);
  }
  std::vector<QuasidefiniteFactor::Edge> edges;
  for (const Joint& joint : joints_) {
    const Index node = static_cast<Index>(sign.size());
    sign.push_back(-1);
    for (Index body : {joint.link.a, joint.link.b})
      if (body >= 0) edges.push_back({node, node_[body]});
  }
  K_.analyse(sign, edges);
  place_.assign(moves_.size(), -1);
  for (std::size_t i = 0; i < moves_.size(); ++i)
    if (moves_[i]) place_[i] = K_.position(static_cast<std::size_t>(node_[i]));
  analysed_moves_ = moves_;
  analysed_link_ = link_;
}

// A system with constrained bodies is itself the rest of another problem.
bool Mechanism::factor_held(const Problem& problem) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || A->constrained) return false;
  analyse(problem, Scope::held);
  return !row_.empty() && takes_little() && factor(problem);
}

// M of the body. A body that only turns, or does not turn, has a unit entry in place of its infinite mass or
// inertia. The columns of D are zero there (assemble_joint).
bool Mechanism::assemble_body(const Bodies& bodies, std::size_t body) {
  double* M = K_.diagonal(static_cast<std::size_t>(node_[body]));
  const double w = bodies.inverse_mass[body];
  for (int k = 0; k < 3; ++k) M[(n + 1) * k] = w > 0 ? 1 / w : 1;
  double I[6] = {1, 1, 1, 0, 0, 0};
  if (turns(bodies, body) && !invert(bodies.inverse_inertia[body], I)) return false;
  for (int k = 0; k < 3; ++k) M[(n + 1) * (3 + k)] = I[k];
  M[n * 3 + 4] = M[n * 4 + 3] = I[3];
  M[n * 3 + 5] = M[n * 5 + 3] = I[4];
  M[n * 4 + 5] = M[n * 5 + 4] = I[5];
  return true;
}

// -E and the rows of D of one joint. Unused rows of a node of six are -1 with zeros beside them: they
// constrain nothing, and their entries of solutions are not read.
void Mechanism::assemble_joint(const Problem& problem, std::size_t joint, std::size_t& edge) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  const Joint& j = joints_[joint];
  double* E = K_.diagonal(node_of_joint(joint));
  for (std::size_t k = 0; k < width; ++k) {
    double e = 1;  // for an unused row
    if (k < j.rows.size())
      e = std::max(A.compliance[row_[j.rows[k]] - contact_rows],
                   second_order::policy.rounding * P_[j.rows[k]]);
    E[(n + 1) * k] = -e;
  }
  for (Index body : {j.link.a, j.link.b}) {
    if (body < 0) continue;
    double* D = K_.block(edge);
    const bool joint_first = K_.a_first(edge);
    const auto i = static_cast<std::size_t>(body);
    const bool moves_all_ways = A.bodies.inverse_mass[i] != 0 && turns(A.bodies, i);
    for (std::size_t k = 0; k < j.rows.size(); ++k) {
      const JacobianRow& row = A.jacobian[row_[j.rows[k]] - contact_rows];
      std::array<double, 6> d = row.body_a == body ? row.a : row.b;
      if (!moves_all_ways) keep_moving(A.bodies, i, d);
      if (joint_first)
        std::copy_n(d.begin(), width, D + n * k);
      else
        for (std::size_t c = 0; c < width; ++c) D[n * c + k] = d[c];
    }
    ++edge;
  }
}

bool Mechanism::factor(const Problem& problem) {
  K_.clear();
  const Bodies& bodies = std::get<ContactSystem>(problem.A).bodies;
  for (std::size_t i = 0; i < node_.size(); ++i)
    if (node_[i] >= 0 && !assemble_body(bodies, i)) return false;
  for (std::size_t j = 0, edge = 0; j < joints_.size(); ++j) assemble_joint(problem, j, edge);
  return K_.factor();
}

void Mechanism::right_side(std::span<const double> u, std::vector<double>& r) const {
  r.assign(width * K_.nodes(), 0.0);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    double* to = &r[width * static_cast<std::size_t>(K_.position(node_of_joint(j)))];
    for (std::size_t i : joints_[j].rows) *to++ = -u[row_[i]];
  }
}

// Entries of w along directions in which the body cannot move are dropped: K has a unit in place of the
// infinite mass there, which would turn them into velocities.
void Mechanism::add_wrenches(const Bodies& bodies, std::span<const double> w, std::vector<double>& r) const {
  for (std::size_t i = 0; i < place_.size(); ++i) {
    if (place_[i] < 0) continue;
    std::array<double, 6> d;
    std::copy_n(&w[width * i], width, d.begin());
    keep_moving(bodies, i, d);
    for (std::size_t k = 0; k < width; ++k) r[width * static_cast<std::size_t>(place_[i]) + k] += d[k];
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
  for (std::size_t i = 0; i < body.size(); ++i) {
    std::array<double, 6> d;
    std::copy_n(w + width * i, width, d.begin());
    keep_moving(bodies, static_cast<std::size_t>(body[i]), d);
    std::copy_n(d.begin(), width, &z[width * static_cast<std::size_t>(place_[body[i]])]);
  }
  solve(z);
  for (std::size_t i = 0; i < body.size(); ++i)
    std::copy_n(&z[width * static_cast<std::size_t>(place_[body[i]])], width, w + width * i);
}

// K (v, -x_f) = (D_c' x_c, -b_f)
void Mechanism::hold(const Problem& problem, std::span<double> x, std::vector<double>& w,
                     std::vector<double>& z) const {
  const auto& A = std::get<ContactSystem>(problem.A);
  for (std::size_t row : row_) x[row] = 0;
  w.assign(width * A.bodies.size(), 0.0);
  amontons::add_impulses(A, x, w);
  right_side(problem.b, z);
  add_wrenches(A.bodies, w, z);
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
