#include "multibody/step/rest.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/ablation.hpp"
#include "amontons/problem/residual.hpp"
#include "multibody/step/assemble.hpp"

namespace amontons {

namespace {

// Quotient of two natural maps: that of two zeros is zero.
double quotient(double map, double at_zero) {
  constexpr double least = 1e-300;  // not tuned: above zero
  return map / std::max(at_zero, least);
}

// Whether an island may still rest.
bool may_any(const Rest& rest) {
  return std::find(rest.rests.begin(), rest.rests.end(), 1) != rest.rests.end();
}

bool is_slow(const BodyVelocity& v, double length, double slow) {
  return norm(v.linear) <= slow && length * norm(v.angular) <= slow;
}

// Finds the island of each body, and the speed that counts as none. The residual is a norm over all bodies of
// an island: one of n equal bodies may have the whole error.
void place(const ContactGraph& graph, std::size_t bodies, double slow, Rest& rest) {
  const std::size_t count = find_islands(graph, rest.island);
  rest.home.assign(bodies, -1);
  rest.slow.assign(count, 0);
  for (std::size_t k = 0; k < graph.links.size(); ++k)
    for (const Index body : {graph.links[k].a, graph.links[k].b}) {
      if (body < 0 || body >= static_cast<Index>(bodies) || rest.home[body] >= 0) continue;
      rest.home[body] = rest.island[k];
      rest.slow[rest.island[k]] += 1;
    }
  for (double& s : rest.slow) s = slow * std::sqrt(s);
}

// Islands with a body that is not slow do not rest.
void keep_slow(double length, const BodyVelocities& v, Rest& rest) {
  for (std::size_t i = 0; i < v.size(); ++i)
    if (rest.home[i] >= 0 && !is_slow(v[i], length, rest.slow[rest.home[i]])) rest.rests[rest.home[i]] = 0;
}

// Nor do islands that touch a driven body that is not slow. Such bodies have no island.
void keep_undriven(const Model& model, const ContactSystem& A, const BodyVelocities& v, Rest& rest) {
  const auto drives = [&](Index body, double slow) {
    return body >= 0 && body < static_cast<Index>(v.size()) && rest.home[body] < 0 &&
           !is_slow(v[body], model.length(), slow);
  };
  bool any = false;
  for (std::size_t i = 0; i < v.size(); ++i) any |= drives(static_cast<Index>(i), 0);
  if (!any) return;
  const auto look_at = [&](const auto& blocks, std::size_t first) {
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const Index island = rest.island[first + i];
      if (drives(blocks[i].body_a, rest.slow[island]) || drives(blocks[i].body_b, rest.slow[island]))
        rest.rests[island] = 0;
    }
  };
  look_at(A.contacts, 0);
  look_at(A.jacobian, A.contacts.size());
}

// Islands whose start is not within the tolerance do not rest.
void keep_solved(const Problem& problem, Law law, double tolerance, const Solution& start, Rest& rest) {
  rest.map.assign(rest.rests.size(), 0);
  rest.map_at_zero.assign(rest.rests.size(), 0);
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    const Index i = rest.island[block];
    if (!rest.rests[i]) return;
    const double zero[S::dim] = {};
    double g[S::dim];
    add_saxce_term(set, law, &start.u[row], g);
    rest.map[i] += natural_map_squared(set, problem.P[block], &start.x[row], g);
    add_saxce_term(set, law, &problem.b[row], g);
    rest.map_at_zero[i] += natural_map_squared(set, problem.P[block], zero, g);
  });
  for (std::size_t i = 0; i < rest.rests.size(); ++i) {
    const double missed = quotient(std::sqrt(rest.map[i]), std::sqrt(rest.map_at_zero[i]));
    if (!(missed <= tolerance)) rest.rests[i] = 0;
  }
}

// The start and b of the islands that move: without new contacts, contacts that turn change b alone, and none
// turns where all rest.
void go_on(const Problem& problem, const std::vector<double>& x0, Rest& rest) {
  rest.x0.resize(rest.part.rows.size());
  for (std::size_t k = 0; k < rest.x0.size(); ++k) {
    rest.x0[k] = x0[rest.part.rows[k]];
    rest.part.problem.b[k] = problem.b[rest.part.rows[k]];
  }
}

}  // namespace

double Rest::residual(Maps others) const {
  double sum = others.map * others.map, sum_at_zero = others.at_zero * others.at_zero;
  for (std::size_t i = 0; i < rests.size(); ++i) {
    sum += rests[i] ? map[i] : 0;
    sum_at_zero += rests[i] ? map_at_zero[i] : 0;
  }
  return quotient(std::sqrt(sum), std::sqrt(sum_at_zero));
}

void form_start(const Problem& problem, std::span<const double> x0, Solution& s) {
  s.x.resize(problem.rows());
  s.u.resize(problem.rows());
  project(problem.K, x0, s.x);
  product(problem.A, s.x, s.u);
  for (std::size_t i = 0; i < s.u.size(); ++i) s.u[i] += problem.b[i];
}

void find_rest(const StepSetting& step, const Observed& o, const Problem& problem, bool again,
               const std::vector<double>& x0, Solution& start, Rest& rest) {
  if (again && rest.any && !rest.moving.empty() && rest.island.size() == problem.K.blocks())
    return go_on(problem, x0, rest);
  rest.any = false;
  rest.moving.clear();
  if (off("at rest") || x0.empty() || o.contacts.empty()) return;
  const Model& model = step.model;
  const double slow = step.options.tolerance * step.h * norm(model.description().gravity);
  const double slowest = slow * std::sqrt(static_cast<double>(model.bodies()));
  // In most scenes that move no contact has slow bodies only, and the islands are not needed.
  const auto may_rest = [&](const Contact& c) {
    const auto is = [&](Index i) { return i < 0 || is_slow(o.start[i], model.length(), slowest); };
    return is(c.body_a) && is(c.body_b);
  };
  if (std::none_of(o.contacts.begin(), o.contacts.end(), may_rest)) return;
  const auto& A = std::get<ContactSystem>(problem.A);
  place(problem.graph, model.bodies(), slow, rest);
  rest.rests.assign(rest.slow.size(), 0);
  for (std::size_t i = 0; i < A.contacts.size(); ++i) rest.rests[rest.island[i]] = 1;
  keep_slow(model.length(), o.start, rest);
  keep_undriven(model, A, o.start, rest);
  if (!may_any(rest)) return;
  rest.v = o.free;
  apply_impulses(problem, x0, rest.v);
  keep_slow(model.length(), rest.v, rest);
  if (!may_any(rest)) return;
  form_start(problem, x0, start);
  keep_solved(problem, step.options.law, step.options.tolerance, start, rest);
  for (std::size_t k = 0; k < rest.island.size(); ++k)
    if (!rest.rests[rest.island[k]]) rest.moving.push_back(k);
  rest.any = may_any(rest) && (rest.moving.empty() || !step.options.own_method);
  if (!rest.any || rest.moving.empty()) return;
  extract(problem, rest.moving, rest.number, rest.part);
  go_on(problem, x0, rest);
}

// Driven bodies keep their velocities.
void stop_resting(const Model& model, const Rest& rest, BodyVelocities& v) {
  if (!rest.any) return;
  for (std::size_t i = 0; i < v.size(); ++i)
    if (rest.home[i] >= 0 && rest.rests[rest.home[i]] && model.is_dynamic(static_cast<Index>(i))) v[i] = {};
}

}  // namespace amontons
