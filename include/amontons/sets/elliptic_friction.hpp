#pragma once
#include "amontons/sets/barrier.hpp"
#include "amontons/sets/set.hpp"

namespace amontons {

// The elliptic friction cone { (n, t) : sum_k (t_k / mu_k)^2 <= n^2, n >= 0 } of 3, 4 or 6 rows: anisotropic
// sliding (t1, t2), torsion about the normal, and rolling (two moments). All mu_k >= 0 and finite; a row with
// mu_k = 0 has no impulse. Moments and their coefficients are divided by a length (Contact::moment_length),
// so that all rows are impulses in N s.
//
// Projection of z = (n, t), with D = diag(mu): z itself if |D^-1 t| <= n, the apex if |D t| <= -n, otherwise
// the foot on the boundary. There, with the multiplier lambda >= 0 of 1/2 (|D^-1 s|^2 - a^2) = 0,
//   a (1 - lambda) = n,   s_k = t_k mu_k^2 / (mu_k^2 + lambda),   a = |D^-1 s| =: h(lambda).
// (1 - lambda) h(lambda) - n falls strictly from |D^-1 t| - n > 0 to -|D t| - n < 0, so lambda is its only
// root. In tau = lambda / (1 + lambda) and w = 1 - tau, with D_k = mu_k^2 w + tau, nothing is singular at a =
// 0 or lambda = 1:
//   F(tau) = (w - tau) K(tau) - n,   K = |(t_k mu_k / D_k)|,   a = w K,   s_k = t_k mu_k^2 w / D_k.
// F(1/2) = -n, so the sign of n determines the smaller of tau and w. The smaller one is the unknown, so that
// its digits are not lost in 1 - tau for large coefficients.
template <int n>
struct EllipticFriction {
  static_assert(n == 3 || n == 4 || n == 6, "sliding; with torsion; with torsion and rolling");
  static constexpr int dim = n;
  static constexpr const char* name = n == 3 ? "elliptic-3" : n == 4 ? "elliptic-4" : "elliptic-6";
  static constexpr bool is_cone = true, frictional = true;
  double mu[n - 1];

  struct Barrier : ConeBarrier<n> {
    Barrier(const EllipticFriction& set, double) : ConeBarrier<n>(std::to_array(set.mu)) {}
  };

  void project(const double* x, double* out) const {
    switch (region(x)) {
      case Region::polar:
        std::fill(out, out + n, 0.0);
        break;
      case Region::inside:
        out[0] = x[0];
        for (int k = 1; k < n; ++k) out[k] = mu[k - 1] > 0 ? x[k] : 0;
        break;
      case Region::boundary: {
        const Root r = root(x);
        const double a = r.w * norm_K(x, r);
        for (int k = 1; k < n; ++k) out[k] = x[k] * (mu2(k) * r.w / D(k, r));
        out[0] = a;
      }
    }
  }
  void natural_map(const double* x, const double* step, double* out) const {
    natural_map_of_cone(*this, x, step, out);
  }

  // The derivative of the equations above. With g_k = t_k / D_k, h_k = mu_k^2 / D_k, G = sum g h dt and S =
  // sum g^2 h (all divided by their powers of w):
  //   ds_0 = w (K G + S dn) / (K^2 + (w - tau) S)
  //   ds_k = w h_k dt_k - g_k h_k ((w - tau) ds_0 - w dn) / K
  Face<n> face(const double* y) const {
    const Region where = region(y);
    if (where != Region::boundary) {
      Face<n> all = face_of_all<n>(where == Region::inside);
      for (int k = 1; k < n; ++k)
        if (mu[k - 1] == 0) all.value[k] = 0;
      return all;
    }
    const Root r = root(y);
    const double K = norm_K(y, r), w = r.w, bend = w - r.tau;
    double g[n] = {}, h[n] = {}, S = 0;
    for (int k = 1; k < n; ++k) {
      if (mu[k - 1] == 0) continue;
      g[k] = y[k] / D(k, r);
      h[k] = mu2(k) / D(k, r);
      S += g[k] * g[k] * h[k];
    }
    const double below = K * K + bend * S;
    double Q[n][n];
    for (int j = 0; j < n; ++j) {  // the response to a unit change of y_j
      Q[0][j] = j == 0 ? w * S / below : w * K * g[j] * h[j] / below;
      for (int k = 1; k < n; ++k)
        Q[k][j] = (k == j ? w * h[k] : 0) - g[k] * h[k] * (bend * Q[0][j] - (j == 0 ? w : 0)) / K;
    }
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < j; ++k) Q[j][k] = Q[k][j] = 0.5 * (Q[j][k] + Q[k][j]);
    return face_of<n>(Q);
  }

  double violation(const double* u) const { return -u[0]; }
  std::string complaint(std::size_t i) const {
    static constexpr const char* names[] = {"mu along tangent 1", "mu along tangent 2", "torsion",
                                            "rolling about tangent 1", "rolling about tangent 2"};
    for (int k = 0; k + 1 < n; ++k)
      if (!(mu[k] >= 0 && std::isfinite(mu[k])))
        return std::string(names[k]) + " of elliptic friction cone " + std::to_string(i) + " is " +
               std::to_string(mu[k]) + "; it must be finite and not negative";
    return {};
  }

  // |D u_t|, the support function of the cross-section n = 1
  double de_saxce(const double* u) const {
    double sum = 0;
    for (int k = 1; k < n; ++k) sum += mu2(k) * u[k] * u[k];
    return std::sqrt(sum);
  }
  void de_saxce_gradient(const double* u, double* out) const {
    const double size = de_saxce(u);
    out[0] = 0;
    for (int k = 1; k < n; ++k) out[k] = size > 0 ? mu2(k) * u[k] / size : 0;
  }
  bool has_friction() const {
    return std::any_of(mu, mu + n - 1, [](double m) { return m > 0; });
  }

 private:
  enum class Region { inside, polar, boundary };
  double mu2(int k) const { return mu[k - 1] * mu[k - 1]; }
  struct Root {
    double tau, w;
  };
  double D(int k, const Root& r) const { return mu2(k) * r.w + r.tau; }

  Region region(const double* z) const {
    double stretched = 0, shrunk = 0;
    for (int k = 1; k < n; ++k) {
      const double m = mu[k - 1];
      if (m > 0) stretched += (z[k] / m) * (z[k] / m);
      shrunk += (m * z[k]) * (m * z[k]);
    }
    if (std::sqrt(shrunk) <= -z[0])
      return Region::polar;  // first: both conditions hold on the negative axis
                             // for mu = 0
    return std::sqrt(stretched) <= z[0] ? Region::inside : Region::boundary;
  }

  double norm_K(const double* z, const Root& r) const {
    double sum = 0;
    for (int k = 1; k < n; ++k) {
      const double part = mu[k - 1] > 0 ? z[k] * mu[k - 1] / D(k, r) : 0;
      sum += part * part;
    }
    return std::sqrt(sum);
  }

  // Newton's method on F inside a bracket, from the root of the circular cone with the mean coefficient. The
  // unknown is the smaller of tau and w: F falls with tau and rises with w.
  Root root(const double* z) const {
    double below = 0, above = 0.5, shrunk = 0, size = 0;
    for (int k = 1; k < n; ++k) {
      shrunk += mu2(k) * z[k] * z[k];
      size += z[k] * z[k];
    }
    const bool seek_tau = z[0] > 0;
    const auto at = [&](double s) { return seek_tau ? Root{s, 1 - s} : Root{1 - s, s}; };
    const double mean = std::sqrt(shrunk / size), t = std::sqrt(size);
    const double up = t * mean - z[0] * mean * mean, down = z[0] + t * mean;  // lambda = up / down
    double s = (seek_tau ? up : down) / (up + down);
    if (!(s > 0 && s < 0.5)) s = 0.25;
    for (int iteration = 0; iteration < 100; ++iteration) {
      const Root r = at(s);
      const double K = norm_K(z, r);
      if (!(K > 0)) return {1, 0};  // t has no effect
      double slope = 0;             // K dK / dtau
      for (int k = 1; k < n; ++k) {
        const double part = mu[k - 1] > 0 ? z[k] * mu[k - 1] / D(k, r) : 0;
        slope -= part * part * (1 - mu2(k)) / D(k, r);
      }
      const double F = (r.w - r.tau) * K - z[0];
      if (std::abs(F) <= 1e-16 * (K + std::abs(z[0]))) return r;
      ((F > 0) == seek_tau ? below : above) = s;
      const double newton = F / ((r.w - r.tau) * slope / K - 2 * K);
      double next = seek_tau ? s - newton : s + newton;
      if (!(next > below && next < above)) next = below > 0 ? std::sqrt(below * above) : 1e-2 * above;
      const double change = std::abs(next - s);
      s = next;
      if (change <= 2e-16 * s) break;
    }
    return at(s);
  }
};

}  // namespace amontons
