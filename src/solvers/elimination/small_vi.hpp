#pragma once
#include <limits>
#include <vector>

#include "solvers/central_path/central_curve.hpp"
#include "solvers/elimination/island_system.hpp"
#include "solvers/elimination/reduction.hpp"

namespace amontons {

// Solves a VI of few rows with its matrix at hand: find x in K with u = W x + q (and the De Saxce term under
// coulomb) in the normal cone. Semismooth Newton steps on the faces of the start, a dense factorisation of
// the rows that act each; where they do not lead on, the central path as a curve
// (central_path/central_curve.hpp). The work is bounded whatever the problem.
class SmallVi {
 public:
  struct Limits {
    // Natural maps in the P of the island, absolute: what is asked for, and what is worth another step or two
    // once it is reached.
    double target, aim;
    std::size_t iterations;  // steps of all kinds; 0: the method's own
  };
  struct Result {
    double map;  // natural, of the x that comes back
    std::size_t iterations, factorizations;
  };
  // Before the first of several solves, which share what the Patience of the thread leaves.
  // Nothing of an earlier step counts: a simulation that was saved and loaded has the same bits.
  void begin();
  // x: the start, and the best x seen. Its memory is kept between calls.
  Result solve(const Reduction::Island& island, Law law, const Limits& limits, std::vector<double>& x);

 private:
  // The derivative of the equation F(x, u) = 0 of a block, G dx + H du, in rows of W each.
  struct Linear {
    std::size_t row, dim;
    bool acts;  // H is not zero
    double F[6], G[36], H[36];
  };

  void start(const Reduction::Island& island);
  void add_product(const std::vector<double>& x, std::vector<double>& u);
  void evaluate(const std::vector<double>& x, std::vector<double>& u);
  double natural_map(const std::vector<double>& x, const std::vector<double>& u) const;
  double keep(const std::vector<double>& x, const std::vector<double>& u);
  bool done() const;
  bool left();
  void pay();
  void find_faces();
  void find_faces_carefully();
  void descend(std::size_t steps);
  void momentum_direction(double L, double& dPd, double& dPm);
  double multiply(const std::vector<double>& d, std::vector<double>& Wd);
  void follow_curve();
  bool step_along(CentralCurve<IslandSystem>& curve);
  bool start_from_convex();
  bool newton_step();
  void linearise();
  const double* product_row(const Linear& l, const double* H);
  bool solve_linear();
  void restart();
  void start_from_nothing();

  const Reduction::Island* island_ = nullptr;
  Law law_{};
  Limits limits_{};
  std::vector<double> p_;  // mean of diag(W) per block
  std::vector<double> x_, u_, dx_, centre_, trial_, trial_u_, best_, held_;
  std::vector<Linear> linear_;
  std::vector<std::size_t> active_, pivots_;
  IslandSystem system_;
  CentralCurve<IslandSystem> curve_, convex_;
  std::size_t work_of_step_ = 0;
  std::vector<double> J_, columns_, rhs_, du_, HW_;
  double sigma_ = 0;
  std::size_t work_ = 0, paid_ = 0, unpaid_ = 0;  // of this solve, of those before it
  std::size_t most_work_ = 0;
  bool ended_ = false;  // no work, time or wish is left
  Result result_{};
};

}  // namespace amontons
