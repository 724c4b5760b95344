// How long work may last, and what is left of it that ends early.
#include <chrono>
#include <cmath>
#include <numeric>
#include <thread>

#include "amontons/base/budget.hpp"
#include "amontons/base/interrupt.hpp"
#include "amontons/base/leave.hpp"
#include "amontons/solvers/linear/block_cholesky.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;

namespace {

constexpr double forever = std::numeric_limits<double>::infinity();

void spin(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
  }
}

// One dense front.
BlockCholesky dense(int n) {
  BlockCholesky c(std::vector<int>{n}, {});
  c.set_zero();
  const auto slot = c.slot(0, 0);
  small::Draws random(3);
  for (int j = 0; j < n; ++j)
    for (int i = j; i < n; ++i)
      c.panels()[slot.offset + static_cast<std::size_t>(j) * slot.stride + i] =
          i == j ? n : random.uniform(-0.5, 0.5);
  return c;
}

}  // namespace

// Breaks when a part may last longer than the whole, or a budget without a limit is late.
TEST(parts_end_with_the_whole) {
  Budget endless;
  CHECK(!endless.late() && endless.left() == forever && endless.work_left() == forever);
  Budget whole(100);
  Budget loose(whole, 1000), tight = whole.part_of_time(1e-11);
  CHECK(loose.left() < 100.1 && tight.late() && tight.left() == 0);
  CHECK(!whole.late() && whole.left() > 50 && whole.ends_within(101));
  Budget rest(whole, forever);
  CHECK(rest.left() < 100.1);
}

// Breaks when the whole does not pay for its parts, or a part may spend more than the whole has.
TEST(the_whole_pays) {
  Budget whole(forever, 100);
  {
    Budget part = whole.part_of_work(0.3);
    part.spend(20);
    CHECK(part.work_left() == 10 && whole.work_left() == 80);
    part.spend(20);
    CHECK(part.exhausted() && !whole.exhausted() && whole.work_left() == 60);
  }
  Budget looser(whole, forever, 1e9);
  CHECK(looser.work_left() == 60);
  whole.limit_work(5);  // a limit that is there stays
  CHECK(looser.work_left() == 60);
  Budget free(forever);
  free.limit_work(5);
  CHECK(free.work_left() == 5);
}

// Breaks when a request to stop is asked for at every look, forgotten, not heard by inner work, or heard by
// another thread.
TEST(requests_to_stop_stay_in_their_thread) {
  int asked = 0;
  {
    const Interrupt outer([&] { return ++asked == 2; });
    for (int i = 0; i < 1000; ++i) CHECK(!Interrupt::requested());
    CHECK(asked == 0);
    spin(0.025);
    CHECK(!Interrupt::requested() && asked == 1);
    spin(0.025);
    const Interrupt inner({});
    CHECK(Interrupt::requested() && asked == 2);
    spin(0.025);
    CHECK(Interrupt::requested() && asked == 2);
    bool elsewhere = true;
    std::thread([&] { elsewhere = Interrupt::requested(); }).join();
    CHECK(!elsewhere);
  }
  CHECK(!Interrupt::requested());
}

// Breaks when work is left where nobody takes care of it, or is not where it is late or would be.
TEST(left_only_where_caught) {
  leave_if_due(1e9);
  const Budget some(10);
  const LeaveScope scope(some);
  leave_if_due(1);
  bool left = false;
  try {
    leave_if_due(20);
  } catch (const LeftEarly& early) {
    left = !early.interrupted;
  }
  CHECK(left);
}

// Breaks when a front that is factored in pieces, with looks at the clock between them, has other bits than
// in one piece, or the factorisation is not left. 700 columns: pieces of two sizes, neither of which divides
// them.
TEST(factorisation_in_pieces) {
  BlockCholesky watched = dense(700);
  {
    const Budget some(100);
    const LeaveScope scope(some);
    CHECK(watched.factor() == 0);
  }
  BlockCholesky left = dense(700);
  bool early = false;
  try {
    const Budget none(1e-9);
    const LeaveScope scope(none);
    left.factor();
  } catch (const LeftEarly&) {
    early = true;
  }
  CHECK(early);
  // L L' x = rhs for rhs = A e: x = e to rounding.
  BlockCholesky matrix = dense(700);
  const auto slot = matrix.slot(0, 0);
  std::vector<double> rhs(700, 0.0);
  for (int j = 0; j < 700; ++j)
    for (int i = j; i < 700; ++i) {
      const double a = matrix.panels()[slot.offset + static_cast<std::size_t>(j) * slot.stride + i];
      rhs[i] += a;
      if (i != j) rhs[j] += a;
    }
  watched.solve(rhs);
  for (double x : rhs) CHECK_NEAR(x, 1.0, 1e-9);
}

// Breaks when a method does not count its work, by iterations or by factorisations.
TEST(work_is_limited) {
  const Problem problem = small::stack(12);
  const double product = static_cast<double>(problem.K.blocks()) + 16;
  for (const char* method :
       {"apgd", "p-spg-fb", "gauss-seidel", "jacobi", "newton", "interior-point", "auto"}) {
    Budget whole(forever, 40 * product);
    Options options;
    options.law = Law::associated;
    options.tolerance = 0;
    options.max_iterations = 100000;
    const Solution s = solve(problem, method, options, whole);
    CHECK(s.status == Status::iteration_limit || s.status == Status::stalled);
    CHECK(whole.exhausted());
    // The last iteration of a method may be one of several products, or factor.
    CHECK(s.products < 40 + 100 && s.factorizations < 20);
  }
}

// Breaks when a method that factors does not come back with a valid point when its time is up before the
// first factor is there.
TEST(methods_end_in_time) {
  const Problem problem = small::stack(12);
  for (const char* method : {"newton", "interior-point", "auto"}) {
    Options options;
    options.law = Law::associated;
    options.deadline = 1e-7;
    options.tolerance = 0;
    const Solution s = solve(problem, method, options);
    CHECK(s.status == Status::deadline);
    CHECK(s.x.size() == problem.rows() && std::isfinite(s.residual));
  }
}
