#pragma once
#include <span>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "solvers/direct/policy.hpp"
#include "solvers/linear/motion_nodes.hpp"
#include "solvers/linear/quasidefinite.hpp"

namespace amontons {

// The bodies of a problem with its bilateral rows (sets Bilateral), in coordinates of motion (MotionNodes):
// M^-1 = C C', Y = D C, velocities C v. With impulses w along the coordinates, the velocities v that they
// cause, and the impulses x of the bilateral rows:
//
//   v - Y'x = w,   Y v + E x = -u_0,   that is   K (v, -x) = (w, -u_0),   K = [1 Y'; Y -E].
//
// K has the pattern of the mechanism, which seldom changes. The analysis is repeated when it does.
class Mechanism {
 public:
  // All bodies that move, or only those that bilateral rows act on.
  enum class Scope : unsigned char { all, held };
  // Takes the bilateral rows of the problem, which has a ContactSystem. K is analysed again if bodies, trees
  // or links differ from the last call.
  void analyse(const Problem& problem, Scope scope = Scope::all);
  bool takes_little() const { return K_.work() <= direct::policy.most_factor_work; }
  // Assembles and factors K. False if a pivot fails: dependent bilateral rows that rounding makes indefinite.
  bool factor(const Problem& problem);
  // Analyses and factors the bilateral rows with their bodies. False where there are none, for constrained
  // bodies, and where K takes much work or has no factorisation.
  bool factor_held(const Problem& problem);

  const QuasidefiniteFactor& K() const { return K_; }
  // The coordinates that are nodes of K, numbered in its order, and the position of a node there.
  const MotionNodes& nodes() const { return nodes_; }
  Index position(int node) const { return K_.position(static_cast<std::size_t>(node)); }
  // Position of the last node that moves a body; -1 for the world and for bodies that impulses do not move.
  Index last_node(Index body) const { return body >= 0 ? last_node_[body] : -1; }
  // The bilateral rows, by their number in the problem.
  const std::vector<std::size_t>& rows() const { return row_; }

  // Right-hand sides and solutions are arrays of six numbers per node, in the order of K. Forms the joints'
  // part of (w, -u_0), with zeros for coordinates; u as in the problem.
  void right_side(std::span<const double> u, std::vector<double>& r) const;
  // In place: from impulses at free bodies to the velocities that they cause, six numbers per body; `body`
  // holds the numbers of the bodies in the problem; z is scratch.
  void move(const Bodies& bodies, const std::vector<Index>& body, double* w, std::vector<double>& z) const;
  // x of the bilateral rows of free bodies, which hold exactly for the impulses of the other rows in x; w and
  // z are scratch.
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
  // Up to six rows, a node of K with the edges [first, last). Rows are given by their place in row_.
  struct Joint {
    std::vector<std::size_t> rows;
    std::size_t first, last;
  };

  void find_joints(const ContactSystem& A);
  void analyse_pattern(const ContactSystem& A);
  void assemble_joint(const Problem& problem, std::size_t joint);
  void solve(std::vector<double>& z) const;
  std::size_t node_of_joint(std::size_t joint) const { return nodes_.size.size() + joint; }

  std::vector<unsigned char> moves_, analysed_moves_;
  std::vector<Link> link_, analysed_link_;
  // The trees of that call: number of each body, last coordinate of each number, parents.
  std::array<std::vector<Index>, 3> analysed_trees_;
  std::vector<std::size_t> row_;
  std::vector<double> P_;  // per row: diag(A)
  MotionNodes nodes_;
  std::vector<Joint> joints_;
  std::vector<int> edge_node_;        // per edge
  std::vector<std::size_t> edge_of_;  // per position: the edge of its node with the present joint
  std::vector<Index> last_node_;
  QuasidefiniteFactor K_;
};

}  // namespace amontons
