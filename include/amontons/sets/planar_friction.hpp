#pragma once
#include "amontons/sets/barrier.hpp"
#include "amontons/sets/set.hpp"

namespace amontons {

// Coulomb's cone in a plane, { (n, t) : |t| <= mu n }, mu >= 0 and finite. It is a wedge of the plane: two
// rays, and no curved rim. It serves wherever slip has one direction only:
//
// - a journal in its bearing: n presses, t turns or slides;
// - a rope around a pulley, with half the sum n and half the difference t of the two tensions. Euler and
//   Eytelwein's law T1 <= T2 exp(mu_p angle) and its reverse are |T1 - T2| <= tanh(mu_p angle / 2) (T1 + T2).
//   So mu = tanh(mu_p angle / 2), and 1 is a rope that cannot slip.
//
// The De Saxce term is needed for ropes as for contacts. Without it a slipping rope would become shorter by
// mu times its slip, as a sliding contact would open.
struct PlanarFriction {
  static constexpr int dim = 2;
  static constexpr const char* name = "planar";
  static constexpr bool is_cone = true, frictional = true;
  double mu;

  struct Barrier : ConeBarrier<2> {
    Barrier(const PlanarFriction& set, double) : ConeBarrier<2>({set.mu}) {}
  };

  // As for Friction: inside, polar cone, or the foot on the ray (c, s sign t) with c = 1/sqrt(1 + mu^2), s =
  // mu c.
  void project(const double* x, double* out) const {
    const double n = x[0], t = std::abs(x[1]);
    if (mu * t <= -n) {
      out[0] = out[1] = 0;
    } else if (t <= mu * n) {
      out[0] = x[0];
      out[1] = x[1];
    } else {
      const double c = 1 / std::sqrt(1 + mu * mu), s = mu * c;
      const double foot = c * n + s * t;
      const double tangent = std::copysign(foot * s, x[1]);
      out[0] = foot * c;
      out[1] = tangent;
    }
  }
  // Outside, z - Pi(z) is the distance c |t| - s n to the ray times its outer normal (-s, c sign t).
  void natural_map(const double* x, const double* step, double* out) const {
    const double n = x[0] - step[0], t = x[1] - step[1];
    if (mu * std::abs(t) <= -n) {
      out[0] = x[0];
      out[1] = x[1];
    } else if (std::abs(t) <= mu * n) {
      out[0] = step[0];
      out[1] = step[1];
    } else {
      const double c = 1 / std::sqrt(1 + mu * mu), s = mu * c;
      const double outside = c * std::abs(t) - s * n;
      out[0] = step[0] - s * outside;
      out[1] = step[1] + std::copysign(c * outside, t);
    }
  }
  // The ray is flat: along it the projection moves with the point, across it not at all.
  Face<2> face(const double* y) const {
    const double t = std::abs(y[1]);
    if (y[0] >= 0 && t <= mu * y[0]) return face_of_all<2>(1);
    if (!(mu * t > -y[0])) return face_of_all<2>(0);
    const double c = 1 / std::sqrt(1 + mu * mu), s = std::copysign(mu * c, y[1]);
    return {{1, 0}, {{c, s}, {-s, c}}};
  }

  double violation(const double* u) const { return -u[0]; }
  std::string complaint(std::size_t i) const {
    if (mu >= 0 && std::isfinite(mu)) return {};
    return "mu of planar friction cone " + std::to_string(i) + " is " + std::to_string(mu) +
           "; it must be finite and not negative";
  }

  // mu |u_t|
  double de_saxce(const double* u) const { return mu * std::abs(u[1]); }
  void de_saxce_gradient(const double* u, double* out) const {
    out[0] = 0;
    out[1] = u[1] == 0 ? 0 : std::copysign(mu, u[1]);
  }
  bool has_friction() const { return mu > 0; }
};

}  // namespace amontons
