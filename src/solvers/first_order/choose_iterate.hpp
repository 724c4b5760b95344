// Private: the choice of the iterate for a problem.
#pragma once
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/plain_iterate.hpp"

namespace amontons {

// Calls f(make), where make() returns the iterate: the fused passes if they support the sets and rows, plain
// loops otherwise. f calls make(), so that the clock of a solve includes it. Only here does a first-order
// method meet an operator; a device adds its line here. f is instantiated for every operator, outside its
// iteration, so that no call inside one is virtual.
template <class F>
auto with_iterate(const Problem& problem, const Options& options, F&& f) {
  return std::visit(
      [&]<class Op>(const Op& A) {
        if constexpr (std::is_same_v<Op, ContactSystem>)
          if (ContactIterate::fits(problem))
            return f([&] { return ContactIterate(problem, law_of(problem, options), options.threads); });
        return f([&] { return PlainIterate<Op>(A, problem, law_of(problem, options)); });
      },
      problem.A);
}

}  // namespace amontons
