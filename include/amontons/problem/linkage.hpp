#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "amontons/problem/jacobian_row.hpp"

namespace amontons {

// Bodies that ideal joints connect to trees. Their velocities are v = J q' with the rates q' of coordinates,
// and their part of M^-1 is J (L'DL)^-1 J' with L'DL = M(q) of the trees, docs/algorithm.md (38). A
// coordinate moves the bodies beyond it, so M couples it only with those on its way to the root. L has the
// same entries: there is no fill (Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 6.5).
//
// Twists and wrenches of a tree are about one reference point of the tree: those of its bodies add.
//
// An example: a base (coordinates 0 to 5) with an arm of two hinges (6, 7) and a leg of one (8). parent is
// -1, 0, 1, 2, 3, 4, 5, 6, 5. Row 7 of M has the entries of 7, 6, 5, ..., 0; row 8 those of 8, 5, ..., 0. Arm
// and leg are coupled by the base only, and M_87 = 0 has no place.
//
// A linkage is plain data. The step fills it from poses (multibody/trees) once, and a problem shares it: a
// problem that a user keeps holds the masses of its own step.
struct Linkage {
  // Bodies of trees: number in the problem, ascending; the last coordinate on the way from the root; centre
  // of mass minus the reference point (m).
  std::vector<Index> body, last;
  std::vector<Vec3> arm;
  // Per body of the model: its number in `body`, -1 outside of trees.
  std::vector<Index> number;
  // Coordinates: the next one towards the root, which has a smaller number (-1: none). The twist per unit
  // rate of all bodies beyond it is the velocity at the reference point and the angular velocity.
  std::vector<Index> parent;
  // How many coordinates on the way to the root are numbered k, k - 1, ... without a gap, k itself included.
  // A branch in depth-first order is one such run, so that loops over ancestors are over a few runs.
  std::vector<Index> run;
  std::vector<std::array<double, 6>> column;
  // Rows of M: M_kk, then M_kj for j = parent[k] and so on to the root; row k begins at first[k]. Replaced by
  // the rows of L by factor(), with D_k in place of the unit diagonal.
  std::vector<std::size_t> first;
  std::vector<double> rows;
  std::vector<double> inverse_root;  // D_k^-1/2

  std::size_t coordinates() const { return parent.size(); }
  Index number_of(Index i) const {
    return i >= 0 && static_cast<std::size_t>(i) < number.size() ? number[i] : -1;
  }
  bool touches(const JacobianRow& row) const {
    return number_of(row.body_a) >= 0 || number_of(row.body_b) >= 0;
  }

  // M = L'DL. A pivot far below its diagonal entry belongs to parallel axes of one joint. It is raised to a
  // share of that entry, as by a small inertia of the drive.
  void factor();
  // Six numbers per body of trees: impulses w at the centres of mass become impulses along the coordinates,
  // J'w; w changes.
  void gather(double* w, double* along) const;
  // J q', six numbers per body of trees.
  void spread(const double* rates, double* v) const;
  // M^-1 in place.
  void solve(double* along) const;
  // J M^-1 J' in place.
  void move(double* w) const;
  // The coordinates that a row of D moves, towards the root: `first` on the path from its body A alone,
  // `second` on that from B alone, then `both` on both.
  struct Paths {
    std::size_t first = 0, second = 0, both = 0;
    std::size_t size() const { return first + second + both; }
  };
  // Appends the coordinates.
  Paths append_paths(const JacobianRow& row, std::vector<Index>& coordinate) const;
  // y = D^-1/2 L^-T (row J)', an entry per coordinate of its paths. D M^-1 D' has the entries y_i'y_j. All
  // rows on the same bodies have the same paths, as those along one coordinate.
  void half_solve(const JacobianRow& row, const Paths& paths, const Index* coordinate, double* y) const;
  // The part of trees in D M^-1 D' of a row, |y|^2, and the row without bodies of trees.
  double inverse_mass(const JacobianRow& row) const;
  JacobianRow without_trees(JacobianRow row) const {
    if (number_of(row.body_a) >= 0) row.body_a = world;
    if (number_of(row.body_b) >= 0) row.body_b = world;
    return row;
  }
};

}  // namespace amontons
