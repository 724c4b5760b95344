#pragma once
#include <limits>
#include <memory>
#include <vector>

#include "solvers/central_path/central_curve.hpp"
#include "solvers/elimination/island_system.hpp"
#include "solvers/elimination/newton_direction.hpp"
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
  // A search for faces: Newton steps in a row, how many of them may pass without a better x; times diag(W),
  // the proximal term of the first, and by what it rises where they do not lead on.
  struct Faces {
    std::size_t steps, patience;
    double proximal, rise;
  };
  static const Faces at_once, carefully;
  // Who asks: somebody else, or a SmallVi for the blocks of its island that act.
  enum class Of { whole, acting };
  Result search(const Reduction::Island& island, Law law, const Limits& limits, std::vector<double>& x,
                Of of);
  void start(const Reduction::Island& island);
  void solve_acting();
  std::size_t add_acting();
  void add_product(const std::vector<double>& x, std::vector<double>& u);
  void evaluate(const std::vector<double>& x, std::vector<double>& u);
  double natural_map(const std::vector<double>& x, const std::vector<double>& u) const;
  double keep(const std::vector<double>& x, const std::vector<double>& u);
  bool done() const;
  bool left();
  void pay();
  void find_faces(const Faces& how);
  void descend(std::size_t steps);
  void momentum_direction(double L, double& dPd, double& dPm);
  double multiply(const std::vector<double>& d, std::vector<double>& Wd);
  void follow_curve();
  bool step_along(CentralCurve<IslandSystem>& curve);
  bool start_from_convex();
  bool newton_step(double sigma);
  void restart();
  void start_from_nothing();

  const Reduction::Island* island_ = nullptr;
  Law law_{};
  Limits limits_{};
  std::vector<double> p_;  // mean of diag(W) per block
  std::vector<double> x_, u_, dx_, du_, trial_, trial_u_, best_, held_;
  NewtonDirection newton_;
  IslandSystem system_;
  CentralCurve<IslandSystem> curve_, convex_;
  // The blocks of the island that act, or did in an earlier round; they as an island, and its VI.
  std::vector<char> acts_;
  Reduction::Island acting_;
  std::vector<double> acting_x_;
  std::unique_ptr<SmallVi> acting_vi_;
  std::size_t work_of_step_ = 0;
  std::size_t work_ = 0, paid_ = 0, unpaid_ = 0;  // of this solve, of those before it
  std::size_t most_work_ = 0;
  bool ended_ = false;  // no work, time or wish is left
  Result result_{};
};

}  // namespace amontons
