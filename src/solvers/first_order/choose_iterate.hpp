// Private: the iterate that serves a problem best.
#pragma once
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "amontons/solvers/first_order/plain_iterate.hpp"

namespace amontons {

// f(make), where make() returns the iterate: with the fused passes where they know the sets and the rows,
// with plain loops elsewhere. Made by f, so that the clock of a solve counts it. The one place where a
// first-order method meets an operator. What the options bring along, a device for instance, goes first. f is
// instantiated for every operator, outside its iteration, so that no call inside one is virtual.
template <class F>
auto with_iterate(const Problem& problem, const Options& options, F&& f) {
  const auto forwarded = [&] { return ForwardedIterate(options.iterates->make(problem, options.law)); };
  if (on_device(problem, options)) return f(forwarded);
  return std::visit(
      [&]<class Op>(const Op& A) {
        if constexpr (std::is_same_v<Op, ContactSystem>)
          if (ContactIterate::fits(problem))
            return f([&] { return ContactIterate(problem, options.law, options.threads); });
        return f([&] { return PlainIterate<Op>(A, problem, options.law); });
      },
      problem.A);
}

}  // namespace amontons
