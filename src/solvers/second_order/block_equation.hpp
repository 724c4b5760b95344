// The equation F(x, u) = 0 of a block, which holds exactly if the block fulfils the law, and its derivative
// dF = G dx + H du. x: impulse, u: velocity, p > 0: a mass that scales them, G and H by rows.
//
// Associated law, single rows, rolling friction: the natural map F = x - Pi(x - g / p) with Q = Pi'
// and g = B u in derivatives, G = I - Q, H = Q B / p.
//
// Friction of circular and elliptic cones under coulomb: the equations of Alart and Curnier (CMAME 92, 1991),
// docs/algorithm.md (33). They have no De Saxce term and so no kink where a sliding contact comes to rest.
// With y = x - u / p, n and t its parts,
//   open    n <= 0          F = x
//   stick   |t| <= mu n     F = u / p
//   slide   else            F_n = u_n / p,   F_t = x_t - mu n e,   e = t / |t|.
// Their zeros are those of the natural map of Coulomb's law, by which residuals are measured.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "amontons/problem/residual.hpp"

namespace amontons {

// Equation and derivative of the natural map.
template <class S>
void linearise_natural(const S& set, Law law, double p, const double* x, const double* u, double* F,
                       double* G, double* H) {
  constexpr int d = S::dim;
  double g[d], step[d], y[d];
  add_de_saxce_term(set, law, u, g);
  for (int k = 0; k < d; ++k) {
    step[k] = g[k] / p;
    y[k] = x[k] - step[k];
  }
  set.natural_map(x, step, F);
  const auto face = set.face(y);
  double Q[d][d] = {};
  for (int k = 0; k < d; ++k)
    if (face.value[k] != 0)
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) Q[i][j] += face.value[k] * face.vector[k][i] * face.vector[k][j];
  // B = I + e_n s'(u)': the normal row of the De Saxce term's derivative.
  double slope[d] = {};
  if constexpr (S::frictional)
    if (law == Law::coulomb) set.de_saxce_gradient(u, slope);
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) {
      G[d * i + j] = (i == j) - Q[i][j];
      H[d * i + j] = (Q[i][j] + Q[i][0] * slope[j]) / p;
    }
}

// Equation of a cone with one coefficient per row, in rows scaled to a ball: x^ = x / mu and u^ = mu u, x^ .
// u^ = x . u, |x^_t| <= x_n. The scaled step 1 / q uses the mean coefficient. A row without friction has no
// impulse.
template <int d>
void linearise_coulomb(const double* mu, double p, const double* x, const double* u, double* F, double* G,
                       double* H) {
  std::fill_n(G, d * d, 0.0);
  std::fill_n(H, d * d, 0.0);
  const double n = x[0] - u[0] / p;
  double q = 0, size = 0, y[d] = {};
  for (int k = 1; k < d; ++k) q += p * mu[k - 1] * mu[k - 1] / (d - 1);
  for (int k = 1; k < d; ++k) {
    if (!(mu[k - 1] > 0)) continue;
    y[k] = x[k] / mu[k - 1] - mu[k - 1] * u[k] / q;
    size += y[k] * y[k];
  }
  size = std::sqrt(size);
  F[0] = n > 0 ? u[0] / p : x[0];
  (n > 0 ? H : G)[0] = 1 / (n > 0 ? p : 1.0);
  for (int i = 1; i < d; ++i) {
    const double m = mu[i - 1];
    F[i] = x[i];
    G[(d + 1) * i] = 1;
    if (!(n > 0) || !(m > 0)) continue;
    if (size <= n) {
      F[i] = u[i] / p;
      G[(d + 1) * i] = 0;
      H[(d + 1) * i] = 1 / p;
      continue;
    }
    const double e = y[i] / size;
    F[i] -= m * n * e;
    G[d * i] = -m * e;
    H[d * i] = m * e / p;
    for (int j = 1; j < d; ++j) {
      if (!(mu[j - 1] > 0)) continue;
      const double turn = m * n / size * ((i == j) - e * y[j] / size);
      G[d * i + j] -= turn / mu[j - 1];
      H[d * i + j] += turn * mu[j - 1] / q;
    }
  }
}

// Friction coefficients of the rows, for the cones that linearise_coulomb() supports.
inline std::array<double, 2> coefficients(const Friction& set) { return {set.mu, set.mu}; }
template <int d>
std::array<double, d - 1> coefficients(const EllipticFriction<d>& set) {
  return std::to_array(set.mu);
}

// The equation of a block under a law.
template <class S>
void block_equation(const S& set, Law law, double p, const double* x, const double* u, double* F, double* G,
                    double* H) {
  if constexpr (requires { coefficients(set); })
    if (law == Law::coulomb) {
      linearise_coulomb<S::dim>(coefficients(set).data(), p, x, u, F, G, H);
      return;
    }
  linearise_natural(set, law, p, x, u, F, G, H);
}

}  // namespace amontons
