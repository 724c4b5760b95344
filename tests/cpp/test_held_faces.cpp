#include <algorithm>
#include <cmath>

#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "multibody/derivatives/held_faces.hpp"
#include "problems.hpp"

using namespace amontons;
using small::largest_difference;
using small::Vector;
using small::velocities;

namespace {

Vector solution(const Problem& problem, Law law) {
  Options options;
  options.law = law;
  options.tolerance = 1e-13;
  return solve(problem, "auto", options).x;
}

Problem moved(const Problem& problem, const Vector& change, double by) {
  Problem nearby = problem;
  for (std::size_t i = 0; i < change.size(); ++i) nearby.b[i] += by * change[i];
  return nearby;
}

}  // namespace

// Breaks when a face has another tangent than its set, or the De Saxce term is left out: the central
// difference of held solutions is that of whole ones. Both err by h^2 = 1e-10 times the third derivative, and
// by 1e-13 / 1e-5 of the solves.
TEST(held_solutions_are_those_of_nearby_problems) {
  constexpr double h = 1e-5;
  int compared = 0;
  for (unsigned seed = 1; seed <= 20; ++seed)
    for (const Law law : {Law::associated, Law::coulomb}) {
      const Problem problem = small::random_mixed(seed, false);
      const Vector x = solution(problem, law);
      const HeldFaces held(problem, law, x);
      if (held.margin() < 1e-3) continue;  // a change of 1e-5 might pass a border
      ++compared;
      small::Random random(seed);
      const Vector change = random.vector(problem.rows());
      Vector expected(x.size()), found(x.size());
      for (const double sign : {1.0, -1.0}) {
        const Problem nearby = moved(problem, change, sign * h);
        const auto near = held.solve(nearby);
        CHECK(near.residual < 1e-12);
        const Vector whole = solution(nearby, law);
        for (std::size_t i = 0; i < x.size(); ++i) {
          expected[i] += sign * whole[i] / (2 * h);
          found[i] += sign * near.x[i] / (2 * h);
        }
      }
      const double scale = largest_difference(expected, Vector(x.size(), 0.0));
      CHECK_NEAR(largest_difference(found, expected), 0, 1e-5 * (1 + scale));
    }
  CHECK(compared >= 10);
}

// Breaks when impulses that are not determined count as velocities that are not, or move when nothing does:
// boxes that stick on four corners each.
TEST(velocities_of_a_stack_that_sticks_are_determined) {
  const Problem sticks = small::stack(2, 1, 0.0);
  const Vector x = solution(sticks, Law::coulomb);
  const HeldFaces held(sticks, Law::coulomb, x);
  CHECK(held.determines_velocities());
  const auto same = held.solve(sticks);
  CHECK_NEAR(largest_difference(velocities(sticks, same.x), velocities(sticks, x)), 0, 1e-10);
}

// Breaks when the rows of another problem are taken for those of the held one.
TEST(other_rows_are_not_held) {
  const Problem two = small::stack(2), three = small::stack(3);
  const HeldFaces held(two, Law::coulomb, solution(two, Law::coulomb));
  CHECK(std::isinf(held.distance(three)));
  Problem far = two;
  for (double& b : far.b) b += 0.5;
  CHECK(std::isinf(held.distance(far)));
  CHECK_NEAR(held.distance(far, 0.6), 0.5, 1e-15);  // where a step closes overlaps at 0.6 m/s
  CHECK_NEAR(held.distance(two), 0, 0);
}

// Breaks when the border of a set is measured elsewhere: one contact of unit mass, pressed with n and pushed
// by t < mu n, is at (mu n - t) / sqrt(1 + mu^2) from its cone, along the normal mu n - t over mu.
TEST(margins_of_one_contact) {
  const auto margin = [](double b_n, double b_t) {
    const Problem p = small::one_contact(0.5, b_n, b_t);
    return HeldFaces(p, Law::coulomb, solution(p, Law::coulomb)).margin();
  };
  CHECK_NEAR(margin(-1.0, 0.3), (0.5 - 0.3) / 0.5, 1e-9);  // sticks
  CHECK_NEAR(margin(2.0, 0.0), 2.0, 1e-9);                 // open
  CHECK(margin(-1.0, 0.5) < 1e-9);                         // between stick and slip
}
