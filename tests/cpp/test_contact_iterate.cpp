#include <algorithm>
#include <cmath>
#include <vector>

#include "amontons/base/isa.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/metric.hpp"
#include "amontons/solvers/first_order/plain_iterate.hpp"
#include "check.hpp"
#include "random.hpp"
#include "vectors.hpp"

using namespace amontons;
using small::largest, small::same_bits;

namespace {

struct Size {
  std::size_t contacts, joints, bodies;
};

// Random contacts and joint rows of every kind between bodies of which every seventh is fixed and body 1 is
// in every fifth contact; some sides are the world, some contacts have no moving body at all.
Problem random_problem(Size size, bool compliant, unsigned seed = 1) {
  small::Draws random(seed);
  const auto uniform = [&](std::size_t n) { return static_cast<Index>(random.below(n)); };
  ContactSystem A;
  Bodies& mass = A.bodies;
  for (std::size_t i = 0; i < size.bodies; ++i) {
    double L[3][3], I[3][3] = {};
    for (auto& row : L)
      for (double& v : row) v = random.normal();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 3; ++k) I[r][c] += 0.3 * L[r][k] * L[c][k];
    const bool fixed = i % 7 == 3;
    mass.inverse_mass.push_back(fixed ? 0 : 0.5 + std::abs(random.normal()));
    if (fixed)
      mass.inverse_inertia.push_back({});
    else
      mass.inverse_inertia.push_back({I[0][0], I[1][1], I[2][2], I[0][1], I[0][2], I[1][2]});
  }
  // Another side than `not_this`; every tenth is the world.
  const auto side = [&](Index not_this) {
    const bool world = not_this >= 0 && (size.bodies == 1 || random.below(10) == 0);
    Index body = world ? Index{-1} : uniform(size.bodies);
    if (body == not_this) body = (body + 1) % static_cast<Index>(size.bodies);
    return body;
  };
  std::vector<double> mu;
  for (std::size_t i = 0; i < size.contacts; ++i) {
    Contact c;
    c.body_a = i % 5 == 0 && size.bodies > 1 ? 1 : uniform(size.bodies);
    c.body_b = side(c.body_a);
    if (i % 3 == 0) std::swap(c.body_a, c.body_b);
    for (int k = 0; k < 3; ++k)
      c.r_a[k] = random.normal(), c.r_b[k] = random.normal(), c.normal[k] = random.normal();
    c.normal = normalised(c.normal);
    A.contacts.push_back(c);
    A.contact_compliance.push_back(compliant ? 0.1 * std::abs(random.normal()) : 0);
    const double values[] = {0, 0.3, 0.5, 1, 20};
    mu.push_back(values[random.below(5)]);
  }
  for (std::size_t i = 0; i < size.joints; ++i) {
    JacobianRow row{uniform(size.bodies), 0, {}, {}};
    row.body_b = side(row.body_a);
    for (double& v : row.a) v = random.normal();
    for (double& v : row.b) v = random.normal();
    A.jacobian.push_back(row);
    A.compliance.push_back(compliant ? 0.2 : 0);
  }
  SetProduct K;
  K.add_each<Friction>(mu);
  const std::size_t third = size.joints / 3;
  K.add_count<Bilateral>(third);
  K.add_each<Interval>(std::vector<double>(third, -0.2), std::vector<double>(third, 0.1));
  K.add_count<NonNegative>(size.joints - 2 * third);
  std::vector<double> b(A.rows());
  for (double& v : b) v = random.normal();
  return make_problem(std::move(A), std::move(b), std::move(K));
}

ContactIterate stages_of(const Problem& p, Law law, unsigned threads = 1, Isa isa = active_isa()) {
  return ContactIterate(p, law, threads, isa);
}

void check_close(const std::vector<double>& a, const std::vector<double>& b) {
  const double scale = 1e-12 * std::max(1.0, largest(b));
  for (std::size_t i = 0; i < a.size(); ++i) CHECK_NEAR(a[i], b[i], scale);
}

// The vectors are of order one, so the terms of a sum that is nearly zero are not.
void check_sum(double a, double b) { CHECK_NEAR(a, b, 1e-11 * (std::abs(b) + 0.01)); }

std::vector<double> random_vector(std::size_t n) {
  small::Draws random(3);
  std::vector<double> x(n);
  for (double& v : x) v = random.normal();
  return x;
}

// Same calls to the fused and to the plain iterate, all results compared.
void compare_with_plain(const Problem& p, Law law, unsigned threads) {
  ContactIterate fast = stages_of(p, law, threads);
  PlainIterate<ContactSystem> plain(std::get<ContactSystem>(p.A), p, law);
  const std::size_t m = p.rows();
  const std::vector<double> x0 = random_vector(m);
  double r2 = plain.start(x0);
  check_sum(fast.start(x0), r2);
  std::vector<double> x(m), u(m), expected(m);
  const double alphas[] = {0.3, 0.7, 0.2, 1.1, 0.4, 0.15}, lambdas[] = {1, 0.5, 1, 0.25, 1, 1};
  for (int i = 0; i < 6; ++i) {
    const Direction a = fast.direction(alphas[i]), b = plain.direction(alphas[i]);
    check_sum(a.dg, b.dg);
    check_sum(a.dPd, b.dPd);
    check_sum(fast.curvature(), plain.curvature());
    const Update s = fast.update(lambdas[i]), t = plain.update(lambdas[i]);
    check_sum(s.sy, t.sy);
    check_sum(s.yPy, t.yPy);
    check_sum(s.residual_squared, t.residual_squared);
    if (i == 2) fast.keep_best(), plain.keep_best();
    // u is what the operator says it is, whatever both iterate do.
    fast.extract(x, u);
    check_close(u, small::velocities(p, x));
    const double nat = natural_map(p, law, x, u);
    check_sum(s.residual_squared, nat * nat);
  }
  check_sum(fast.objective(), plain.objective());
  plain.extract_best(expected);
  fast.extract_best(x);
  check_close(x, expected);
  r2 = plain.refresh();
  check_sum(fast.refresh(), r2);
  plain.keep_best(), plain.extract_best(expected);
  fast.extract(x, u);
  check_close(x, expected);
}

// The same for the accelerated iteration.
void compare_momentum_with_plain(const Problem& p, Law law, unsigned threads) {
  ContactIterate fast = stages_of(p, law, threads);
  PlainIterate<ContactSystem> plain(std::get<ContactSystem>(p.A), p, law);
  const std::size_t m = p.rows();
  const std::vector<double> x0 = random_vector(m);
  std::vector<double> x(m), u(m), expected(m);
  fast.start(x0), plain.start(x0);
  fast.start_momentum(), plain.start_momentum();
  const double alphas[] = {0.3, 0.7, 0.2, 1.1, 0.4, 0.15}, betas[] = {0, 0.5, 0.9, 0, 0.3, 0.6};
  for (int i = 0; i < 6; ++i) {
    fast.momentum_direction(2 * alphas[i]);  // a rejected step leaves nothing behind
    const MomentumDirection a = fast.momentum_direction(alphas[i]), b = plain.momentum_direction(alphas[i]);
    check_sum(a.dPd, b.dPd);
    CHECK_NEAR(a.dPm, b.dPm, 1e-10 * (1 + std::abs(b.dPd)));
    check_sum(fast.curvature(), plain.curvature());
    const double r2 = fast.accelerate(betas[i]);
    check_sum(r2, plain.accelerate(betas[i]));
    if (i == 2) fast.keep_best(), plain.keep_best();
    fast.extract(x, u);
    check_close(u, small::velocities(p, x));
    const double nat = natural_map(p, law, x, u);
    check_sum(r2, nat * nat);
    if (i == 3) check_sum(fast.refresh_momentum(), plain.refresh_momentum());
  }
  plain.extract_best(expected);
  fast.extract_best(x);
  check_close(x, expected);
}

// A run as the solver does it; every number that comes out of it.
std::vector<double> trace(const Problem& p, Law law, unsigned threads, Isa isa) {
  ContactIterate iterate = stages_of(p, law, threads, isa);
  std::vector<double> out{iterate.start(random_vector(p.rows()))};
  double alpha = 0.5;
  for (int i = 0; i < 8; ++i) {
    const Direction d = iterate.direction(alpha);
    const double dAd = iterate.curvature();
    const Update s = iterate.update(std::min(1.0, -d.dg / dAd));
    alpha = s.sy > 0 ? s.sy / s.yPy : 1;
    out.insert(out.end(), {d.dg, d.dPd, dAd, s.sy, s.yPy, s.residual_squared, iterate.objective()});
    if (i == 3) iterate.keep_best();
  }
  iterate.start_momentum();
  for (int i = 0; i < 8; ++i) {
    const MomentumDirection d = iterate.momentum_direction(0.4);
    out.insert(out.end(), {d.dPd, d.dPm, iterate.curvature(), iterate.accelerate(0.1 * i)});
    if (i == 5) out.push_back(iterate.refresh_momentum());
  }
  std::vector<double> x(p.rows()), u(p.rows());
  iterate.extract(x, u);
  out.insert(out.end(), x.begin(), x.end());
  out.insert(out.end(), u.begin(), u.end());
  iterate.extract_best(x);
  out.insert(out.end(), x.begin(), x.end());
  return out;
}

constexpr Law laws[] = {Law::associated, Law::coulomb};

}  // namespace

// Breaks when a lane, a short batch, a dummy line, a ghost line of a hub or a joint row is handled wrongly.
TEST(fused_stages_equal_plain_stages) {
  const Size sizes[] = {{1, 0, 1},      {1, 1, 2},        {7, 0, 3},    {7, 3, 5},
                        {9, 4, 4},      {0, 10, 6},       {100, 0, 40}, {100, 31, 40},
                        {1001, 0, 300}, {1001, 100, 300}, {64, 0, 15},  {300, 30, 25}};
  for (Size size : sizes)
    for (Law law : laws)
      for (bool compliant : {false, true}) {
        compare_with_plain(random_problem(size, compliant), law, 1);
        compare_momentum_with_plain(random_problem(size, compliant), law, 1);
      }
}

// The same problem with all rows stored, as files have them.
Problem with_rows(const Problem& p) {
  return make_problem(std::get<ContactSystem>(p.A).stored(), std::vector<double>(p.b), SetProduct(p.K));
}

// Breaks when a row or a moment of a contact that is given by its rows goes to another lane, body or sign, or
// its joints are taken for rows of contacts.
TEST(fused_stages_of_stored_rows_equal_plain_stages) {
  for (Size size : {Size{1, 1, 2}, Size{9, 4, 4}, Size{100, 31, 40}, Size{300, 30, 25}})
    for (Law law : laws)
      for (bool compliant : {false, true}) {
        const Problem p = with_rows(random_problem(size, compliant));
        CHECK(ContactIterate::fits(p));
        compare_with_plain(p, law, 1);
        compare_momentum_with_plain(p, law, 1);
      }
}

// Breaks when bodies shared between chunks lose or double an impulse.
TEST(fused_stages_of_two_threads_equal_plain_stages) {
  for (Law law : laws) {
    compare_with_plain(random_problem({20001, 3000, 7001}, false), law, 2);
    compare_momentum_with_plain(random_problem({20001, 3000, 7001}, false), law, 2);
  }
}

// Breaks when chunks, or the order in which their sums are added, follow from the number of threads.
TEST(threads_do_not_change_a_bit) {
  for (Size size : {Size{1001, 100, 300}, Size{20001, 3000, 7001}, Size{10, 20000, 900}}) {
    const Problem p = random_problem(size, true);
    const std::vector<double> one = trace(p, Law::coulomb, 1, active_isa());
    for (unsigned threads : {2u, 3u}) CHECK(same_bits(one, trace(p, Law::coulomb, threads, active_isa())));
  }
}

// Breaks when a kernel contracts a product and a sum in one set, or adds its lanes in an order of its own.
TEST(instruction_sets_do_not_change_a_bit) {
  for (Size size : {Size{9, 4, 4}, Size{1001, 100, 300}, Size{9001, 100, 3000}})
    for (Law law : laws) {
      const Problem p = random_problem(size, size.contacts == 1001);
      const std::vector<double> baseline = trace(p, law, 1, Isa::baseline);
      const Problem rows = with_rows(p);
      const std::vector<double> of_rows = trace(rows, law, 1, Isa::baseline);
      for (Isa isa : {Isa::avx2, Isa::avx512}) {
        if (!(isa <= active_isa())) continue;
        CHECK(same_bits(baseline, trace(p, law, 1, isa)));
        CHECK(same_bits(of_rows, trace(rows, law, 1, isa)));
      }
    }
}

// Breaks when a pass writes into the buffer that holds the best iterate.
TEST(best_iterate_survives) {
  const Problem p = random_problem({9, 4, 4}, false);
  ContactIterate iterate = stages_of(p, Law::associated);
  std::vector<double> x(p.rows()), u(p.rows()), best(p.rows());
  iterate.start({});
  iterate.extract_best(best);
  CHECK(largest(best) == 0);
  for (int i = 0; i < 12; ++i) {
    iterate.direction(0.3), iterate.curvature(), iterate.update(1);
    if (i % 5 == 1) iterate.keep_best(), iterate.extract(x, u);
    iterate.extract_best(best);
    CHECK(same_bits(best, x));
  }
}

// Breaks when a start outside of K is taken as it is, or a block is projected on its neighbour's set.
TEST(start_projects) {
  const Problem p = random_problem({100, 31, 40}, false);
  ContactIterate iterate = stages_of(p, Law::associated);
  std::vector<double> x0 = random_vector(p.rows()), x(p.rows()), u(p.rows());
  iterate.start(x0);
  iterate.extract(x, u);
  project(p.K, x0, x0);
  check_close(x, x0);
}

// Breaks when a pass over no batches reads one, or a sum over nothing is not zero.
TEST(empty_problem) {
  const Problem p = make_problem(ContactSystem{}, {}, SetProduct{});
  ContactIterate iterate = stages_of(p, Law::coulomb, 2);
  CHECK(iterate.start({}) == 0);
  CHECK(iterate.direction(1).dg == 0);
  CHECK(iterate.curvature() == 0);
  CHECK(iterate.update(1).residual_squared == 0);
  CHECK(iterate.objective() == 0);
}

// Breaks when mu^2 or mu |t| overflows to a NaN in the kernel, or a frictionless contact keeps a tangential
// part.
TEST(extreme_friction) {
  Problem p = random_problem({64, 0, 15}, false);
  for (double mu : {0.0, 1e12, 1e150}) {
    p.K = SetProduct{};
    p.K.add_each<Friction>(std::vector<double>(64, mu));
    for (Law law : laws)
      if (law == Law::associated || mu < 1e100) {
        const std::vector<double> values = trace(p, law, 1, active_isa());
        CHECK(std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); }));
      }
    if (mu < 1e100) compare_with_plain(p, Law::associated, 1);
  }
}

// Breaks when the fused natural map is formed as x - Pi_K(x - step): once x is large, x - step rounds to x,
// the difference to zero, and impulses that run off look converged. x grows by powers of ten from 1 to 1e18
// along a direction inside the cones, on their boundary, and outside; both passes must see the same residual.
// Both maps round the part of x across the ray, eps |x|, as u is rounded by A x; inside the cones they are
// `step` itself.
TEST(natural_map_of_growing_impulses) {
  for (Law law : laws)
    for (int where = 0; where < 3; ++where) {
      Problem p = random_problem({40, 12, 9}, false, 5);
      auto& A = std::get<ContactSystem>(p.A);
      for (double& w : A.bodies.inverse_mass) w = 0;  // u stays b, whatever x is
      for (auto& I : A.bodies.inverse_inertia) I = {};
      SetProduct K;  // without friction a contact is on the boundary wherever it is
      for (const Friction& cone : p.K.all<Friction>()) K.append(Friction{std::max(cone.mu, 0.3)});
      for (std::size_t i = 0; i < A.jacobian.size(); ++i) K.append(NonNegative{});
      p.K = K;
      make_contact_graph(A, p.K, p.graph);
      p.P.assign(p.P.size(), 1.0);
      for (double scale = 1; scale < 2e18; scale *= 10) {
        std::vector<double> x(p.rows(), 0.1 * scale);
        for (std::size_t i = 0; i < A.contacts.size(); ++i) {
          const double mu = p.K.all<Friction>()[i].mu;
          x[3 * i] = where == 2 ? -scale : scale;
          x[3 * i + 1] = (where == 0 ? 0.3 : 0.6) * mu * scale;
          x[3 * i + 2] = (where == 0 ? 0.3 : 0.8) * mu * scale;
        }
        ContactIterate fused = stages_of(p, law);
        PlainIterate<ContactSystem> plain(A, p, law);
        const double a = std::sqrt(fused.start(x)), b = std::sqrt(plain.start(x));
        CHECK_NEAR(a, b, 1e-13 * b + 1e-13 * (where == 0 ? 10 : scale));
        CHECK(a > 0.1);
      }
    }
}

// Breaks when the passes take on sets that their kernels do not know, which they would then project wrongly.
TEST(passes_fit_what_they_know) {
  Problem p = random_problem({9, 4, 4}, false);
  CHECK(ContactIterate::fits(p));
  std::get<ContactSystem>(p.A).contacts[2].direction = {1, 0, 0};
  CHECK(!ContactIterate::fits(p));
  // Forces on the two bodies that are not opposite, a compliance of its own for a row.
  Problem rows = with_rows(random_problem({9, 4, 4}, false));
  auto& stored = std::get<ContactSystem>(rows.A);
  for (JacobianRow& row : stored.jacobian)
    if (row.body_a >= 0 && row.body_b >= 0) row.a[0] += 1;
  CHECK(!ContactIterate::fits(rows));
  rows = with_rows(random_problem({9, 4, 4}, false));
  std::get<ContactSystem>(rows.A).compliance[4] = 1;
  CHECK(!ContactIterate::fits(rows));
  p.A = std::get<ContactSystem>(random_problem({9, 4, 4}, false).A);
  SetProduct K;
  K.append(Friction{0.5});
  K.append(EllipticFriction<3>{0.5, 0.3});
  for (int i = 0; i < 7; ++i) K.append(Friction{0.5});
  K.add_count<Bilateral>(4);
  p.K = K;
  CHECK(!ContactIterate::fits(p));
}

// Breaks when the projection of APGD is not the nearest point of the cone in its metric, or when the metric
// counts a contact for more or less than P does.
TEST(projections_in_the_metric_are_nearest) {
  const Problem p = random_problem({40, 5, 12}, false);
  const std::vector<BlockMetric> metrics = block_metrics(p);
  const std::vector<double> z = random_vector(p.rows());
  double largest_aspect = 0;
  for_each_block(p.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    const BlockMetric& P = metrics[block];
    double mean = 0, x[S::dim], from_normal = 0;
    for (int k = 0; k < S::dim; ++k) mean += P[k] / S::dim;
    CHECK_NEAR(mean, p.P[block], 1e-12 * p.P[block]);
    project_in(P, set, &z[row], x);
    if constexpr (std::is_same_v<S, Friction>) {
      largest_aspect = std::max(largest_aspect, P.aspect);
      // z - x is normal to the cone at x: orthogonal to x, and at most so to the rays of the cone.
      for (int k = 0; k < 3; ++k) from_normal += P[k] * (z[row + k] - x[k]) * x[k];
      CHECK_NEAR(from_normal, 0, 1e-10 * P.tangent * (1 + set.mu * set.mu));
      for (int i = 0; i < 32; ++i) {
        const double ray[] = {1, set.mu * std::cos(0.2 * i), set.mu * std::sin(0.2 * i)};
        double uphill = 0;
        for (int k = 0; k < 3; ++k) uphill += P[k] * (z[row + k] - x[k]) * ray[k];
        CHECK(uphill <= 1e-10 * P.tangent * (1 + set.mu));
      }
    }
  });
  CHECK(largest_aspect > 1.05);
}
