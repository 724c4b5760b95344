#pragma once
#include <memory>
#include <span>
#include <vector>

#include "amontons/problem/problem.hpp"

// Derivatives of solutions, by the implicit function theorem.
namespace amontons {

// A solution with the faces of K on which it lies. A nearby problem is solved on the same faces as a linear
// system, with the factors of this one. To first order its solution is that of the variational inequality, as
// long as no face changes.
//
// Equation. With g = u + de_saxce(u) e_n and the trial point t = x - g / p of a block, a solution has
// x = Pi(t). Held, Pi and de_saxce are their tangents at the trial point t0 and the velocity u0 of this
// solution:
//
//   x = Pi(t0) + Q (t - t0),   Q = Pi'(t0),
//   g = u + (de_saxce(u0) + de_saxce'(u0) (u - u0)) e_n,   u = A x + b.
//
// Pi, Q and de_saxce are those of the nearby set, whose coefficients may differ.
class HeldFaces {
 public:
  // x: a solution of the problem, to rounding. InputError if there are more than `most_rows` rows.
  HeldFaces(const Problem& problem, Law law, std::vector<double> x);
  ~HeldFaces();

  static constexpr std::size_t most_rows = 3000;  // of a dense matrix of 72 MB

  struct Nearby {
    std::vector<double> x;
    double residual = 0;  // largest error of the held equations (m/s)
  };
  // How far another problem is from this one: the largest difference of b (m/s), infinite if its rows are not
  // those of this one. closed: by how much b may differ because overlaps are closed in a step (m/s).
  double distance(const Problem& problem, double closed = 0) const;
  // The solution of a problem at a finite distance.
  Nearby solve(const Problem& problem) const;

  // The least change of a velocity of a row (m/s) with which a block may reach another face.
  double margin() const { return margin_; }
  // Whether the velocities after the step follow from the faces, although impulses may not (a table on four
  // legs).
  bool determines_velocities() const { return determined_; }

 private:
  struct Factor;
  void form(const Problem& problem);
  void find_margin(const Problem& problem);
  // F(x), of which a held solution is a zero, and the velocity u of x.
  void held_map(const Problem& problem, std::span<const double> x, std::vector<double>& u,
                std::vector<double>& F) const;
  // The largest of impulses as velocities of their own rows, P x (m/s).
  double largest_velocity(const double* impulses) const;

  Law law_;
  SetProduct K_;
  std::vector<double> x_, u_, trial_, P_, b_;
  std::unique_ptr<Factor> factor_;  // the inverse of F'(x)
  double fastest_ = 0;              // of b (m/s)
  double margin_ = 0;
  bool determined_ = true;
};

}  // namespace amontons
