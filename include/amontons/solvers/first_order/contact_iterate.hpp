#pragma once
#include <memory>
#include <span>

#include "amontons/base/isa.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/first_order/sums.hpp"

namespace amontons {

// The stages of a spectral projected gradient iteration for bodies and contacts, fused into three passes over
// memory: a trial point with its projection (direction), the inverse masses (curvature), and the new iterate
// with its residual (update). The plain twin for any operator is PlainIterate (solvers/iterate.hpp).
//
// K holds one friction cone per contact of A, in order, followed by free, nonnegative or interval blocks for
// the joint rows; P has one positive number per block. x and u are impulses (N s) and velocities (m/s); spans
// are in user order: (normal, t1, t2) of each contact with the tangents of contact_tangents(), then the joint
// rows. Nothing is kept of the arguments of the constructor. All sums have a fixed order: the results are the
// same bits for any number of threads and any instruction set.
class ContactIterate {
 public:
  // Throws InputError if K, b or P do not fit A. threads >= 1; small problems use one whatever is asked for.
  ContactIterate(const ContactOperator& A, const SetProduct& K, std::span<const double> b,
                 std::span<const double> P, Law law, unsigned threads, Isa isa = active_isa());
  ContactIterate(ContactIterate&&) noexcept;
  ~ContactIterate();

  // x = Pi_K(x0) (0 if x0 is empty), u = A x + b. Returns the square of the natural map of the law.
  double start(std::span<const double> x0);
  // u = A x + b from scratch, which removes the rounding that updates accumulate; the same return value.
  double refresh();
  // d = Pi_K(x - alpha P^-1 g) - x with g = u + De Saxce term.
  Direction direction(double alpha);
  // <d, A d>, the product of the iteration.
  double curvature();
  // x += lambda d, u += lambda A d; needs curvature() first.
  Update update(double lambda);

  // The accelerated iteration: x+ = y + d from an extrapolated point y = x + beta (x - x_old).
  void start_momentum();  // y = x
  // d = Pi_K(y - alpha P^-1 g(y)) - y; may be called again with another alpha.
  MomentumDirection momentum_direction(double alpha);
  // x+ = y + d, y = x+ + beta (x+ - x); needs curvature() first. Returns the squared natural map at x+.
  double accelerate(double beta);
  double refresh_momentum();  // refresh() for x and for y

  // The current x becomes the best one. It costs nothing: x rotates through three buffers.
  void keep_best();
  void extract_best(std::span<double> x) const;
  void extract(std::span<double> x, std::span<double> u) const;
  double objective() const;  // 1/2 x'Ax + b'x = 1/2 <x, u + b>

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace amontons
