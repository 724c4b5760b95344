#pragma once
#include <memory>
#include <span>

#include "amontons/base/isa.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/first_order/iterate.hpp"

namespace amontons {

// An Iterate (iterate.hpp) for bodies and contacts, fused into three passes over memory. These are a trial
// point with its projection (direction), the inverse masses (curvature), and the new iterate with its
// residual (update). Its plain twin for any operator is PlainIterate. src/solvers/first_order/pass_data.hpp
// describes the layout of the arrays.
//
// x and u are impulses (N s) and velocities (m/s). They are stored in world coordinates, where a circular
// cone needs no tangents. Spans are in the order of the problem and in the frames of the contacts. All sums
// have a fixed order: the bits of the results do not depend on the number of threads or on the instruction
// set.
class ContactIterate {
 public:
  // Whether the passes support the sets of a problem. It must be a ContactSystem whose contacts are circular
  // friction cones, and whose stored rows are free, nonnegative or bounded.
  static bool fits(const Problem& problem);

  // The problem need not outlive it. threads >= 1; small problems use one thread.
  ContactIterate(const Problem& problem, Law law, unsigned threads, Isa isa = active_isa());
  ContactIterate(ContactIterate&&) noexcept;
  ~ContactIterate();

  double start(std::span<const double> x0);
  double refresh();
  Direction direction(double alpha);
  double curvature();
  Update update(double lambda);

  // The accelerated iteration. Its arrays y and u_y exist after the first start_momentum().
  void start_momentum();
  MomentumDirection momentum_direction(double alpha);
  double accelerate(double beta);
  double refresh_momentum();

  // Costs no copy: x rotates through three buffers.
  void keep_best();
  void extract_best(std::span<double> x) const;
  void extract(std::span<double> x) const;
  void extract(std::span<double> x, std::span<double> u) const;
  double objective() const;

 private:
  // Arrays, layout and threads. Hidden, because their types are private to src/solvers/first_order.
  struct State;
  std::unique_ptr<State> state_;
};
static_assert(Iterate<ContactIterate>);

}  // namespace amontons
