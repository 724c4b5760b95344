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

// A run of a method over that iterate. A function of its own: Clang 22 does not emit the virtual functions of
// a class template that it first meets inside a generic lambda.
template <template <Iterate> class Method, class Make>
std::unique_ptr<Run> started(const Problem& problem, const Options& options, Make make) {
  using Over = Method<decltype(make())>;
  return std::make_unique<Driven<Over>>(
      problem, options, [&](const Options& o, Monitor& monitor) { return Over(o, monitor, make()); });
}
template <template <Iterate> class Method>
std::unique_ptr<Run> start_over_iterate(const Problem& problem, const Options& options) {
  return with_iterate(problem, options, [&](auto make) { return started<Method>(problem, options, make); });
}

// The whole of a run over such an iterate, and where that was. A source is asked twice, here and before the
// run, and answers alike: it knows the problem and nothing else.
inline Solution complete_where(std::unique_ptr<Run> run, const Problem& problem, const Options& options) {
  Solution s = complete(std::move(run));
  s.device = device_of(problem, options);
  return s;
}

}  // namespace amontons
