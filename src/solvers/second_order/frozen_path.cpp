// One outer step of the fixed point on the De Saxce term (Cadoux 2009; Acary, Cadoux, Lemarechal, Malick
// 2011). Coulomb's law asks for x in K with u + s(u) e_n in K* and <x, u + s(u) e_n> = 0, s(u) = mu |u_t|.
// For a constant s this is the associated law with b_n + s in place of b_n, a convex problem with a solution
// u'(s). The law holds if s = s(u'(s)). Such a fixed point exists under mild conditions (they prove it), but
// the iteration s := s(u'(s)) need not contract.
//
// First-order iterates find soon which contacts slide, but only slowly the stresses of a hyperstatic stack.
// The interior point finds these at once. So in each round
//   1.  a central path solves the convex problem of the best x so far,
//   2.  a burst of apgd from there renews the term.
// Either alone needs ten times the work. Two rounds without progress end it.
#include "solvers/second_order/frozen_path.hpp"

#include <limits>
#include <optional>

#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "solvers/second_order/policy.hpp"

namespace amontons {

namespace {

Problem with_frozen_term(const Problem& problem, const std::vector<double>& u) {
  Problem frozen = problem;
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t, std::size_t row) {
    double g[S::dim];
    add_de_saxce_term(set, Law::coulomb, &u[row], g);
    frozen.b[row] += g[0] - u[row];
  });
  return frozen;
}

// An iteration of the driver is one round: a path, then the burst of apgd.
class FrozenPath : public VectorIterate {
 public:
  static constexpr const char* name = "apgd after a frozen path";
  static constexpr Limits limits{std::numeric_limits<std::size_t>::max(), 1, 0};
  using VectorIterate::VectorIterate;

  std::optional<double> step() {
    // 1. The path starts cold: the term holds the directions of friction, and the path replaces the stresses.
    // It goes to the end. Its last factorisations are few, and the burst needs stresses that are right.
    Options o = options;
    o.law = Law::associated;
    o.x0 = {};
    o.tolerance = 0.5 * options.tolerance;
    o.max_iterations = 0;
    o.history = false;
    o.callback = nullptr;
    const Problem frozen = with_frozen_term(problem, u);
    Solution path = complete(start_central_path(frozen, o, monitor.budget()));
    count(path);
    // 2.
    o.law = options.law;
    o.x0 = path.x;
    o.tolerance = options.tolerance;
    o.max_iterations = second_order::policy.burst;
    Solution s = apgd(problem, o, monitor.budget());
    count(s);
    x = std::move(s.x);
    return evaluate();
  }

 private:
  void count(const Solution& s) {
    monitor.products += s.products;
    monitor.factorizations += s.factorizations;
    if (s.status == Status::interrupted) monitor.interrupt();
  }
};

}  // namespace

std::unique_ptr<Run> start_frozen_path(const Problem& problem, const Options& options, Budget& budget) {
  return drive<FrozenPath>(problem, options, budget);
}

}  // namespace amontons
