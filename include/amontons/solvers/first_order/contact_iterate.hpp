#pragma once
#include <memory>
#include <span>

#include "amontons/base/isa.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/first_order/iterate.hpp"

namespace amontons {

// An Iterate (iterate.hpp) for bodies and contacts, fused into three passes over memory: a trial point with
// its projection (direction), the inverse masses (curvature), and the new iterate with its residual
// (update). Its plain twin for any operator is PlainIterate. How the arrays lie is told in
// src/solvers/first_order/pass_data.hpp.
//
// x and u are impulses (N s) and velocities (m/s), inside in world coordinates, where a circular cone needs
// no tangents; spans are in the order of the problem, in the frames of the contacts. All sums have a fixed
// order: the results are the same bits for any number of threads and any instruction set.
class ContactIterate {
 public:
  // Whether the passes know the sets of a problem: a ContactSystem whose contacts are circular friction
  // cones, and whose stored rows are free, nonnegative or bounded.
  static bool fits(const Problem& problem);

  // Nothing is kept of the problem. threads >= 1; small problems use one whatever is asked for.
  ContactIterate(const Problem& problem, Law law, unsigned threads, Isa isa = active_isa());
  ContactIterate(ContactIterate&&) noexcept;
  ~ContactIterate();

  double start(std::span<const double> x0);
  double refresh();
  Direction direction(double alpha);
  double curvature();
  Update update(double lambda);

  // The accelerated iteration; its arrays y and u_y exist from the first start_momentum() on.
  void start_momentum();
  MomentumDirection momentum_direction(double alpha);
  double accelerate(double beta);
  double refresh_momentum();

  // It costs nothing: x rotates through three buffers.
  void keep_best();
  void extract_best(std::span<double> x) const;
  void extract(std::span<double> x) const;
  void extract(std::span<double> x, std::span<double> u) const;
  double objective() const;

 private:
  // Arrays, layout and threads; hidden, as their types are private to the folder of the sources.
  struct State;
  std::unique_ptr<State> state_;
};
static_assert(Iterate<ContactIterate>);

}  // namespace amontons
