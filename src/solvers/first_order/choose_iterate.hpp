// Private: the iterate that serves a problem best.
#pragma once
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/plain_iterate.hpp"

namespace amontons {

// f(make), where make() returns the iterate: with the fused passes where they know the sets and the rows,
// with plain loops elsewhere. Made by f, so that the clock of a solve counts it. The one place where a
// first-order method meets an operator: a device has its line here. f is instantiated for every operator,
// outside its iteration, so that no call inside one is virtual.
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
