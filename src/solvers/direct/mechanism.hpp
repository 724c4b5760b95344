#pragma once
#include <span>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "solvers/linear/quasidefinite.hpp"

namespace amontons {

// Zero in the place of velocities that no impulse changes: of a body that only turns or does not turn.
void keep_moving(const Bodies& bodies, std::size_t body, std::array<double, 6>& d);

// The bodies of a problem with its bilateral rows (sets Bilateral): with the velocities v that impulses w at
// the bodies bring about, and the impulses x of those rows,
//
//   M v - D'x = w,   D v + E x = -u_0,   that is   K (v, -x) = (w, -u_0),   K = [M D'; D -E].
//
// The pattern of K is that of the mechanism, which seldom changes: it is analysed when it does.
class Mechanism {
 public:
  // All bodies that move, or only those that bilateral rows act on.
  enum class Scope : unsigned char { all, held };
  // Takes the bilateral rows of the problem, which has a ContactSystem. K is analysed anew if bodies or links
  // are others than in the last call.
  void analyse(const Problem& problem, Scope scope = Scope::all);
  // K and its factorisation. False if a pivot fails: a body that turns about some axes only, or bilateral
  // rows whose dependence rounding makes indefinite.
  bool factor(const Problem& problem);

  const QuasidefiniteFactor& K() const { return K_; }
  // Where a body stands in the order of K; -1 for the world and bodies that impulses do not move.
  Index place(Index body) const { return body >= 0 ? place_[body] : -1; }
  // The last place of the mechanism that a place belongs to: mechanisms are what bilateral rows connect.
  Index root(Index place) const { return root_[place]; }
  // The bilateral rows, by their number in the problem.
  const std::vector<std::size_t>& rows() const { return row_; }

  // Right-hand sides and solutions are arrays of six numbers per node, in the order of K. The joints' part of
  // (w, -u_0), bodies zero; u as in the problem.
  void right_side(std::span<const double> u, std::vector<double>& r) const;
  // Adds impulses at the bodies, six numbers per body of the problem.
  void add_wrenches(const Bodies& bodies, std::span<const double> w, std::vector<double>& r) const;
  // In place: velocities of bodies (their numbers in the problem) of the impulses at them, six numbers each;
  // z is scratch.
  void move(const Bodies& bodies, const std::vector<Index>& body, double* w, std::vector<double>& z) const;
  // x of the bilateral rows, which hold exactly with the impulses of all others in x; w and z are scratch.
  void hold(const Problem& problem, std::span<double> x, std::vector<double>& w,
            std::vector<double>& z) const;
  // Changes x of the bilateral rows by what u = A x + b has left of zero there.
  void correct(std::span<const double> u, std::span<double> x, std::vector<double>& z) const;
  // x += the impulses of the rows in a solution z.
  void add_impulses(std::span<const double> z, std::span<double> x) const;

 private:
  static constexpr std::size_t width = QuasidefiniteFactor::width;
  struct Link {
    Index a, b;
    bool operator==(const Link&) const = default;
  };
  // Up to six rows between the same two bodies: a node of K. Rows by their place in row_.
  struct Joint {
    Link link;
    std::vector<std::size_t> rows;
  };

  void analyse_pattern();
  bool assemble_body(const Bodies& bodies, std::size_t body);
  void assemble_joint(const Problem& problem, std::size_t joint, std::size_t& edge);
  std::size_t node_of_joint(std::size_t joint) const { return K_.nodes() - joints_.size() + joint; }

  std::vector<unsigned char> moves_, analysed_moves_;
  std::vector<Link> link_, analysed_link_;
  std::vector<std::size_t> row_;
  std::vector<double> P_;  // of the rows: diag(A)
  std::vector<Joint> joints_;
  std::vector<Index> node_, place_, root_;
  QuasidefiniteFactor K_;
};

}  // namespace amontons
