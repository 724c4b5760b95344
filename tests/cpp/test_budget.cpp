// How long work may last, and what is left of it that ends early.
#include <cmath>
#include <numeric>
#include <thread>

#include "amontons/base/budget.hpp"
#include "amontons/solvers/linear/block_cholesky.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;

namespace {

constexpr double forever = std::numeric_limits<double>::infinity();

void spin(double seconds) {
  const auto end = Budget::Clock::now() + std::chrono::duration<double>(seconds);
  while (Budget::Clock::now() < end) {
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

// Breaks when an inner limit outlives its scope, a looser one replaces a tighter one, or work without any
// limit is late.
TEST(limits_nest) {
  CHECK(!Budget::late() && !Budget::interrupted() && Budget::left() == forever);
  const Budget outer(100);
  {
    const Budget loose(1000);
    CHECK(Budget::left() < 100.1);
    const Budget tight(1e-9);
    CHECK(Budget::late() && Budget::left() == 0);
  }
  CHECK(!Budget::late() && Budget::left() > 50);
  const Budget endless(forever);
  CHECK(Budget::left() < 100.1);
}

// Breaks when a wish to stop is asked for at every look, forgotten, not heard by inner work, or heard by
// another thread.
TEST(wishes_to_stop_stay) {
  int asked = 0;
  {
    const Budget outer(forever, [&] { return ++asked == 2; });
    for (int i = 0; i < 1000; ++i) CHECK(!Budget::interrupted());
    CHECK(asked == 0);
    spin(0.025);
    CHECK(!Budget::interrupted() && asked == 1);
    spin(0.025);
    const Budget inner(forever);
    CHECK(Budget::interrupted() && asked == 2);
    spin(0.025);
    CHECK(Budget::interrupted() && asked == 2);
    bool elsewhere = true;
    std::thread([&] { elsewhere = Budget::interrupted(); }).join();
    CHECK(!elsewhere);
  }
  CHECK(!Budget::interrupted());
}

// Breaks when work is left where nobody takes care of it, or is not where it is late or would be.
TEST(left_only_where_caught) {
  Budget::leave_if_due(1e9);
  {
    const Budget late(1e-9);
    Budget::leave_if_due();
  }
  const Budget caught(10, {}, Budget::Catches::yes);
  Budget::leave_if_due(1);
  bool left = false;
  try {
    Budget::leave_if_due(20);
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
    const Budget some(100, {}, Budget::Catches::yes);
    CHECK(watched.factor() == 0);
  }
  BlockCholesky left = dense(700);
  bool early = false;
  try {
    const Budget none(1e-9, {}, Budget::Catches::yes);
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

// Breaks when work is not counted, by iterations or by factorisations, a scope forgets what an inner one
// spent, or an inner scope may spend more than the outer one has.
TEST(work_is_limited) {
  CHECK(Budget::work_left() == forever && !Budget::exhausted());
  const Problem problem = small::stack(12);
  const double product = static_cast<double>(problem.K.blocks()) + 16;
  for (const char* method :
       {"apgd", "p-spg-fb", "gauss-seidel", "jacobi", "newton", "interior-point", "auto"}) {
    const Budget outer(forever, {}, Budget::Catches::no, 1e9);
    const Budget inner(forever, {}, Budget::Catches::no, 40 * product);
    Options options;
    options.law = Law::associated;
    options.tolerance = 0;
    options.max_iterations = 100000;
    const Solution s = solve(problem, method, options);
    CHECK(s.status == Status::iteration_limit || s.status == Status::stalled);
    CHECK(Budget::exhausted());
    // The last iteration of a method may be one of several products, or factor.
    CHECK(s.products < 40 + 100 && s.factorizations < 20);
    const Budget looser(forever, {}, Budget::Catches::no, 1e9);
    CHECK(Budget::exhausted());
  }
}

// Breaks when a method that factors does not come back with a valid point when its time is up before the
// first factor is there.
TEST(methods_end_in_time) {
  const Problem problem = small::stack(12);
  for (const char* method : {"newton", "interior-point", "admm", "auto"}) {
    Options options;
    options.law = Law::associated;
    options.deadline = 1e-7;
    options.tolerance = 0;
    const Solution s = solve(problem, method, options);
    CHECK(s.status == Status::deadline);
    CHECK(s.x.size() == problem.rows() && std::isfinite(s.residual));
  }
}
