#pragma once
#include <span>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "solvers/direct/policy.hpp"
#include "solvers/linear/quasidefinite.hpp"

namespace amontons {

// Sets to zero those velocities that no impulse changes: of a body that only turns or does not turn.
void keep_moving(const Bodies& bodies, std::size_t body, std::array<double, 6>& d);

// The bodies of a problem with its bilateral rows (sets Bilateral). w: impulses at the bodies; v: the
// velocities that they cause; x: the impulses of the bilateral rows:
//
//   M v - D'x = w,   D v + E x = -u_0,   that is   K (v, -x) = (w, -u_0),   K = [M D'; D -E].
//
// K has the pattern of the mechanism, which seldom changes. The analysis is repeated when it does.
class Mechanism {
 public:
  // All bodies that move, or only those that bilateral rows act on.
  enum class Scope : unsigned char { all, held };
  // Takes the bilateral rows of the problem, which has a ContactSystem. K is analysed again if bodies or
  // links differ from the last call.
  void analyse(const Problem& problem, Scope scope = Scope::all);
  bool takes_little() const { return K_.work() <= direct::policy.most_factor_work; }
  // Assembles and factors K. False if a pivot fails: for a body that turns about some axes only, or for
  // dependent bilateral rows that rounding makes indefinite.
  bool factor(const Problem& problem);
  // Analyses and factors the bilateral rows with their bodies. False where there are none, for constrained
  // bodies, and where K takes much work or has no factorisation.
  bool factor_held(const Problem& problem);

  const QuasidefiniteFactor& K() const { return K_; }
  // Place of a body in the order of K; -1 for the world and for bodies that impulses do not move.
  Index place(Index body) const { return body >= 0 ? place_[body] : -1; }
  // The bilateral rows, by their number in the problem.
  const std::vector<std::size_t>& rows() const { return row_; }

  // Right-hand sides and solutions are arrays of six numbers per node, in the order of K. Forms the joints'
  // part of (w, -u_0), with zeros for bodies; u as in the problem.
  void right_side(std::span<const double> u, std::vector<double>& r) const;
  // Adds impulses at the bodies, six numbers per body of the problem.
  void add_wrenches(const Bodies& bodies, std::span<const double> w, std::vector<double>& r) const;
  // In place: from impulses at bodies to the velocities that they cause, six numbers per body; `body` holds
  // the numbers of the bodies in the problem; z is scratch.
  void move(const Bodies& bodies, const std::vector<Index>& body, double* w, std::vector<double>& z) const;
  // x of the bilateral rows, which hold exactly for the impulses of the other rows in x; w and z are scratch.
  void hold(const Problem& problem, std::span<double> x, std::vector<double>& w,
            std::vector<double>& z) const;
  // Corrects x of the bilateral rows for the remaining u = A x + b there.
  void correct(std::span<const double> u, std::span<double> x, std::vector<double>& z) const;
  // Adds to x the impulses of the rows in a solution z.
  void add_impulses(std::span<const double> z, std::span<double> x) const;

 private:
  static constexpr std::size_t width = QuasidefiniteFactor::width;
  struct Link {
    Index a, b;
    bool operator==(const Link&) const = default;
  };
  // Up to six rows between the same two bodies: a node of K. Rows are given by their place in row_.
  struct Joint {
    Link link;
    std::vector<std::size_t> rows;
  };

  void analyse_pattern();
  void solve(std::vector<double>& z) const;
  bool assemble_body(const Bodies& bodies, std::size_t body);
  void assemble_joint(const Problem& problem, std::size_t joint, std::size_t& edge);
  std::size_t node_of_joint(std::size_t joint) const { return K_.nodes() - joints_.size() + joint; }

  std::vector<unsigned char> moves_, analysed_moves_;
  std::vector<Link> link_, analysed_link_;
  std::vector<std::size_t> row_;
  std::vector<double> P_;  // per row: diag(A)
  std::vector<Joint> joints_;
  std::vector<Index> node_, place_;
  QuasidefiniteFactor K_;
};

}  // namespace amontons
