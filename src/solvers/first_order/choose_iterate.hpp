// Private: the choice of the iterate for a problem.
#pragma once
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "amontons/solvers/first_order/plain_iterate.hpp"
#include "solvers/first_order/on_device.hpp"

namespace amontons {

// Calls f(make), where make() returns the iterate: the fused passes if they support the sets and rows, plain
// loops otherwise. f calls make(), so that the clock of a solve includes it. Only here does a first-order
// method meet an operator; a device adds its line here. f is instantiated for every operator, outside its
// iteration, so that no call inside one is virtual.
template <class F>
auto with_iterate(const Problem& problem, const Options& options, F&& f) {
  const auto forwarded = [&] {
    return ForwardedIterate(options.iterates->make(problem, law_of(problem, options)));
  };
  if (on_device(problem, options)) return f(forwarded);
  return std::visit(
      [&]<class Op>(const Op& A) {
        if constexpr (std::is_same_v<Op, ContactSystem>)
          if (ContactIterate::fits(problem))
            return f([&] { return ContactIterate(problem, law_of(problem, options), options.threads); });
        return f([&] { return PlainIterate<Op>(A, problem, law_of(problem, options)); });
      },
      problem.A);
}

// A run of a method over that iterate. A separate function, because Clang 22 does not emit the virtual
// functions of a class template that it first meets inside a generic lambda.
template <template <Iterate> class Method, class Make>
std::unique_ptr<Run> started(const Problem& problem, const Options& options, Budget& budget, Make make) {
  using Over = Method<decltype(make())>;
  Options own = options;  // the run keeps a copy
  own.law = law_of(problem, options);
  return std::make_unique<Driven<Over>>(
      problem, own, budget, [&](const Options& o, Monitor& monitor) { return Over(o, monitor, make()); });
}
// Kind describes the method to a device that makes whole iterations (on_device.hpp).
template <template <Iterate> class Method, class Kind>
std::unique_ptr<Run> start_over_iterate(const Problem& problem, const Options& options, Budget& budget) {
  if (on_device(problem, options) && options.iterates->make_method)
    return std::make_unique<Driven<OnDevice<Kind>>>(
        problem, options, budget, [&](const Options& o, Monitor& monitor) {
          return OnDevice<Kind>(o, monitor, o.iterates->make_method(problem, law_of(problem, o), o.threads));
        });
  return with_iterate(problem, options,
                      [&](auto make) { return started<Method>(problem, options, budget, make); });
}

// Completes a run over such an iterate and records its place. A source is queried twice, here and before the
// run, with equal answers, because it depends on the problem only.
inline Solution complete_where(std::unique_ptr<Run> run, const Problem& problem, const Options& options) {
  Solution s = complete(std::move(run));
  s.device = device_of(problem, options);
  return s;
}

}  // namespace amontons
