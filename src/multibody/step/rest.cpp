// An island at rest has the same problem in each step, and the impulses of the last step solve it. The
// residual r of an island bounds the velocity error of each of its bodies. The natural map of a block with p,
// the mean of its diag(A), is the energy norm of its velocity error: v^2 / p. That of zero impulses is n (g
// h)^2 / p for n equal bodies at rest. So v <= r sqrt(n) g h.
//
// A body that stops loses that velocity, and with it momentum. The scene as a whole may lose the error of a
// start within the tolerance; if it did not, the errors of starts would add up. Beside other bodies that
// move, momentum is kept to the rounding of a direct solve. Islands that the race solves do not come to rest
// there.
//
// Islands are found only if some contact has slow bodies on both sides. Each test is made only if an island
// may still rest. So a robot that walks pays for one look at its velocities. Islands that move become a
// problem of their own, because the direct way and the race work on all rows of a problem. A is block
// diagonal over islands, so that leaving some out is exact (choice/islands.hpp).
#include "multibody/step/rest.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/start.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/policy.hpp"

namespace amontons {

namespace {

// Quotient of two natural maps: that of two zeros is zero.
double quotient(double map, double at_zero) {
  constexpr double least = 1e-300;  // not tuned: above zero
  return map / std::max(at_zero, least);
}

// Whether an island still counts as resting.
bool rests_any(const Rest& rest) {
  return std::find(rest.rests.begin(), rest.rests.end(), 1) != rest.rests.end();
}

bool is_slow(const BodyVelocity& v, double length, double slow) {
  return norm(v.linear) <= slow && length * norm(v.angular) <= slow;
}

// The speed of an error of 1, per island. The residual is a norm over all bodies of an island: one of n equal
// bodies may have the whole error.
void find_speeds(double fall, std::size_t bodies, const Islands& islands, Rest& rest) {
  rest.speed.assign(islands.count, 0);
  for (std::size_t i = 0; i < bodies; ++i)
    if (const Index home = islands.of_body[i]; home >= 0) rest.speed[home] += 1;
  for (double& s : rest.speed) s = fall * std::sqrt(s);
}

// Islands with a body that moves by more than this error do not rest. Bodies that impulses do not move have
// no island, and need none. A box on a conveyor moves with it. A box that is held above a conveyor slides on
// it for ever with the same impulses. The velocity of the conveyor is in b, and so in the residual of the
// start, which is what counts.
void keep_slow(double length, const BodyVelocities& v, double error, const Islands& islands, Rest& rest) {
  for (std::size_t i = 0; i < v.size(); ++i)
    if (const Index home = islands.of_body[i]; home >= 0 && !is_slow(v[i], length, error * rest.speed[home]))
      rest.rests[home] = 0;
}

// Islands whose start is not within the tolerance do not rest: `most`, if all rest, else `rounding`.
void keep_solved(const Problem& problem, Law law, double most, double rounding, const Solution& start,
                 Rest& rest) {
  rest.map.assign(rest.rests.size(), 0);
  rest.map_at_zero.assign(rest.rests.size(), 0);
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    const Index i = problem.graph.islands.of_block[block];
    if (!rest.rests[i]) return;
    const double zero[S::dim] = {};
    double g[S::dim];
    add_saxce_term(set, law, &start.u[row], g);
    rest.map[i] += natural_map_squared(set, problem.P[block], &start.x[row], g);
    add_saxce_term(set, law, &problem.b[row], g);
    rest.map_at_zero[i] += natural_map_squared(set, problem.P[block], zero, g);
  });
  const auto meets = [&](std::size_t i, double bound) {
    return quotient(std::sqrt(rest.map[i]), std::sqrt(rest.map_at_zero[i])) <= bound;
  };
  for (std::size_t i = 0; i < rest.rests.size(); ++i) rest.slow = rest.slow && meets(i, most);
  for (std::size_t i = 0; i < rest.rests.size(); ++i)
    if (!meets(i, rest.slow ? most : rounding)) rest.rests[i] = 0;
}

// The start and b of the islands that move: without new contacts, contacts that turn change b alone, and none
// turns where all rest.
void go_on(const Problem& problem, const std::vector<double>& x0, Rest& rest) {
  rest.part.take(x0, rest.x0);
  rest.part.take(problem.b, rest.part.problem.b);
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

// The islands at rest, in rest.rests; false if there is none. The velocities at the start may be as large as
// the error of a start within the tolerance: the impulses of this step take them out. Those after them may
// not, unless all rests, because the bodies lose what remains.
static bool find_islands_at_rest(const StepSetting& step, const Observed& o, const PosedStart& posed,
                                 Solution& start, Rest& rest) {
  const Model& model = step.model;
  const double fall = step.h * norm(model.description().gravity), tolerance = step.options.tolerance;
  const double slowest = tolerance * fall * std::sqrt(static_cast<double>(model.bodies()));
  const auto slow = [&](const BodyVelocity& v) { return is_slow(v, model.length(), slowest); };
  const auto slow_at = [&](Index body) { return body < 0 || slow(o.start[body]); };
  const auto may_rest = [&](const Contact& c) { return slow_at(c.body_a) && slow_at(c.body_b); };
  if (std::none_of(o.contacts.begin(), o.contacts.end(), may_rest)) return false;
  const double rounding = step::policy.direct_start * tolerance;
  const Problem& problem = posed.problem;
  const Islands& islands = problem.graph.islands;
  find_speeds(fall, model.bodies(), islands, rest);
  rest.rests.assign(rest.speed.size(), 1);
  rest.slow = std::all_of(o.start.begin(), o.start.end(), slow);
  if (!rest.slow) keep_slow(model.length(), o.start, tolerance, islands, rest);
  if (!rests_any(rest)) return false;
  if (posed.predicted.empty()) apply_impulses(problem, posed.x0, rest.v = o.free);
  const BodyVelocities& v = posed.predicted.empty() ? rest.v : posed.predicted;
  rest.slow = rest.slow && std::all_of(v.begin(), v.end(), slow);
  if (!rest.slow) keep_slow(model.length(), v, rounding, islands, rest);
  if (!rests_any(rest)) return false;
  begin_at(problem, posed.x0, start);
  keep_solved(problem, step.options.law, tolerance, rounding, start, rest);
  return rests_any(rest);
}

void find_rest(const StepSetting& step, const Observed& o, const PosedStart& posed, Solution& start,
               Rest& rest) {
  const Problem& problem = posed.problem;
  // Without new contacts the islands that rested beside an earlier solve of the step still do.
  if (posed.again && rest.any && !rest.moving.empty() && start.x.size() == problem.rows())
    return go_on(problem, posed.x0, rest);
  rest.any = false;
  rest.moving.clear();
  if (posed.x0.empty() || o.contacts.empty() || !find_islands_at_rest(step, o, posed, start, rest)) return;
  const std::vector<Index>& island = problem.graph.islands.of_block;
  for (std::size_t k = 0; k < island.size(); ++k)
    if (!rest.rests[island[k]]) rest.moving.push_back(k);
  rest.any = rest.moving.empty() || !step.options.own_method;
  if (!rest.any || rest.moving.empty()) return;
  extract(problem, rest.moving, rest.number, rest.part);
  go_on(problem, posed.x0, rest);
}

// Driven bodies keep their velocities.
void stop_resting(const Model& model, const Islands& islands, const Rest& rest, BodyVelocities& v) {
  if (!rest.any) return;
  const auto stops = [&](std::size_t i) {
    const Index home = islands.of_body[i];
    return home < 0 ? rest.slow : rest.rests[home] != 0;
  };
  for (std::size_t i = 0; i < v.size(); ++i)
    if (stops(i) && model.is_dynamic(static_cast<Index>(i))) v[i] = {};
}

}  // namespace amontons
