// The impulses of a start within the tolerance leave velocities as large as the tolerance allows. A body that
// stops loses them, and with them momentum. So the impulses of an island that stops are those of a static
// problem, without gaps:
//
//   u = A x + b,  b = D v - A x0,  x in K, -u in N_K(x),
//
// where x0 leaves v. If the bodies can stand, u = 0 and v = 0 at its solution. Gaps of the size of rounding,
// which no motion closes together, are not in its way.
#include "multibody/step/carry.hpp"

#include <type_traits>

#include "amontons/solvers/first_order/apgd.hpp"
#include "multibody/joints/row_terms.hpp"

namespace amontons {

namespace {

bool is_at_rest(const BodyVelocity& v) { return v.linear == Vec3{} && v.angular == Vec3{}; }

// Whether the surfaces of a contact slide over each other if all bodies stand that impulses move.
bool moves_at_rest(const Contact& c, const ContactGraph& graph, const BodyVelocities& v) {
  const auto is_driven = [&](Index body) { return body >= 0 && !graph.moves[body] && !is_at_rest(v[body]); };
  return !(c.surface_velocity == Vec3{}) || is_driven(c.body_a) || is_driven(c.body_b);
}

}  // namespace

Part find_carrying(const PosedImpulses& posed, const BodyVelocities& v,
                   const std::function<bool(Index)>& counts, Options options, Budget& budget) {
  const auto& [problem, contacts, x] = posed;
  const auto& A = std::get<ContactSystem>(problem.A);
  const ContactGraph& graph = problem.graph;
  std::vector<unsigned char> slides(graph.islands.count, 0);
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (moves_at_rest(contacts[i], graph, v)) slides[graph.islands.of_block[i]] = 1;
  Part part;
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    const Index home = graph.islands.of_block[block];
    if (counts(home) && !slides[home] && (std::is_same_v<S, Bilateral> || x[row] != 0))
      part.blocks.push_back(block);
  });
  if (part.blocks.empty()) return part;
  std::vector<Index> number;
  part.make(problem, x, number);
  Problem& still = part.of.problem;
  const std::vector<JacobianRow> rows = A.stored().jacobian;
  // Auxiliary bodies have no velocity to lose.
  BodyVelocities lost = v;
  lost.resize(A.bodies.size());
  std::get<ContactSystem>(still.A).product(part.x0, still.b);
  for (std::size_t k = 0; k < still.b.size(); ++k)
    still.b[k] = row_velocity(rows[part.of.rows[k]], lost) - still.b[k];
  options.x0 = part.x0;
  // Where the bodies cannot stand, no solution is found, and all work may go into the search. The solve of
  // the step, which follows, keeps as much.
  Budget half = budget.part_of_work(0.5);
  part.solution = apgd(still, options, half);
  return part;
}

}  // namespace amontons
