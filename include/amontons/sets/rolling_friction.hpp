#pragma once
#include "amontons/sets/barrier.hpp"
#include "amontons/sets/set.hpp"

namespace amontons {

// Sliding and rolling friction side by side, { (n, t, m) : |t| <= mu n, |m| <= mu_r n }, t and m with two
// rows each. It is the set of FCLIB's rolling problems (Acary, Bourrier, "Coulomb friction with rolling
// resistance as a cone complementarity problem", European Journal of Mechanics A 85, 2021). mu, mu_r >= 0 and
// finite. Moments and mu_r are divided by a length (Contact::moment_length).
//
// Projection: for given n the two discs are independent, so it remains to find
//   min over a >= 0 of (a - n)^2 + (|t| - mu a)_+^2 + (|m| - mu_r a)_+^2.
// The slope grows with a and has four linear pieces; the result is the root of the piece that is valid there.
struct RollingFriction {
  static constexpr int dim = 5;
  static constexpr const char* name = "rolling";
  static constexpr bool is_cone = true, frictional = true;
  double mu, mu_r;

  void project(const double* x, double* out) const {
    const Foot f = foot(x);
    out[0] = f.a;
    for (int part = 0; part < 2; ++part)
      for (int k = 1 + 2 * part; k < 3 + 2 * part; ++k)
        out[k] = !f.bound[part]     ? x[k]
                 : f.size[part] > 0 ? x[k] * (f.a * coefficient(part) / f.size[part])
                                    : 0.0;
  }
  void natural_map(const double* x, const double* step, double* out) const {
    natural_map_of_cone(*this, x, step, out);
  }

  // If a disc limits its part, s = mu a tau with tau = t / |t|: ds = mu tau da + (mu a / |t|) (1 - tau tau')
  // dt; a free part moves with t. da = (dn + sum mu tau' dt) / (1 + sum mu^2), summed over the limited parts.
  Face<5> face(const double* y) const {
    const Foot f = foot(y);
    if (!(f.a > 0)) return face_of_all<5>(0);
    if (!f.bound[0] && !f.bound[1]) return face_of_all<5>(1);
    double Q[5][5] = {}, da[5] = {1}, below = 1;
    for (int part = 0; part < 2; ++part) {
      if (!f.bound[part]) continue;
      const double c = coefficient(part);
      below += c * c;
      for (int k = 1 + 2 * part; k < 3 + 2 * part; ++k)
        da[k] = f.size[part] > 0 ? c * y[k] / f.size[part] : 0;
    }
    for (double& v : da) v /= below;
    for (int j = 0; j < 5; ++j) Q[0][j] = da[j];
    for (int part = 0; part < 2; ++part) {
      const double c = coefficient(part), size = f.size[part];
      for (int k = 1 + 2 * part; k < 3 + 2 * part; ++k) {
        if (!f.bound[part]) {
          Q[k][k] = 1;
          continue;
        }
        if (!(size > 0)) continue;
        for (int j = 0; j < 5; ++j) Q[k][j] = c * y[k] / size * da[j];
        Q[k][k] += c * f.a / size;
        for (int j = 1 + 2 * part; j < 3 + 2 * part; ++j)
          Q[k][j] -= c * f.a / size * (y[k] / size) * (y[j] / size);
      }
    }
    return face_of<5>(Q);
  }

  double violation(const double* u) const { return -u[0]; }
  std::string complaint(std::size_t i) const {
    for (int part = 0; part < 2; ++part) {
      const double value = coefficient(part);
      if (!(value >= 0 && std::isfinite(value)))
        return std::string(part == 0 ? "mu" : "rolling") + " of rolling friction cone " + std::to_string(i) +
               " is " + std::to_string(value) + "; it must be finite and not negative";
    }
    return {};
  }

  // mu |u_t| + mu_r |u_m|, the support function of the two discs
  double de_saxce(const double* u) const {
    return mu * std::sqrt(u[1] * u[1] + u[2] * u[2]) + mu_r * std::sqrt(u[3] * u[3] + u[4] * u[4]);
  }
  void de_saxce_gradient(const double* u, double* out) const {
    out[0] = 0;
    for (int part = 0; part < 2; ++part) {
      const double* v = u + 1 + 2 * part;
      const double size = std::sqrt(v[0] * v[0] + v[1] * v[1]);
      for (int k = 0; k < 2; ++k) out[1 + 2 * part + k] = size > 0 ? coefficient(part) * v[k] / size : 0;
    }
  }
  bool has_friction() const { return mu > 0 || mu_r > 0; }

  // Two second-order cones B_j x in L that share the normal, u = sum_j B_j' z_j. With dz_j = W_j (rho_j - W_j
  // B_j dx) the block of the Newton system is H = M'M of the stacked M = (W_1 B_1; W_2 B_2). With M = Q U the
  // factor is R = U^-1, its target R' M' rho = Q' rho, and the W_j B_j dx are the rows of M R z = Q z. H
  // squares the condition of M and is never formed. The intersection is no symmetric cone, but each factor is
  // one.
  class Barrier {
   public:
    Barrier(const RollingFriction& set, double)
        : cone_{ConeBarrier<3>({set.mu, set.mu}), ConeBarrier<3>({set.mu_r, set.mu_r})} {
      // Without friction one cone remains, the half-line along the normal.
      const bool slides = set.mu > ConeBarrier<3>::flat, rolls = set.mu_r > ConeBarrier<3>::flat;
      used_[0] = slides || !rolls;
      used_[1] = rolls;
    }
    double degree() const { return used_[0] + used_[1]; }
    void start_factor(double* R) {
      stack([](ConeBarrier<3>& cone, int k) {
        second_order::V<3> column{};
        column[k] = cone.D[k];
        return column;
      });
      factor_stack(R);
    }
    void start(const double* solution) {
      each([&](ConeBarrier<3>& cone, const int* row) {
        const double part[3] = {solution[row[0]], solution[row[1]], solution[row[2]]};
        cone.start(part);
      });
    }
    void worst(double& low_x, double& low_u) {
      each([&](ConeBarrier<3>& cone, const int*) { cone.worst(low_x, low_u); });
    }
    // The cones share the normal: it moves by the larger of the two shifts.
    void push(double more_x, double more_u) {
      double least = INFINITY;
      each([&](ConeBarrier<3>& cone, const int*) { least = std::min(least, cone.D[0]); });
      each([&](ConeBarrier<3>& cone, const int*) { cone.push(more_x / least * cone.D[0], more_u); });
    }
    void factor(double* R) {
      each([](ConeBarrier<3>& cone, const int*) { cone.W = second_order::Scaling<3>(cone.u, cone.x); });
      stack([](ConeBarrier<3>& cone, int k) {
        second_order::V<3> unit{};
        unit[k] = cone.D[k];
        return cone.W.times(unit);
      });
      factor_stack(R);
    }
    void dual_factor(double* T) const {
      for (int i = 0; i < 5; ++i)
        for (int k = 0; k < 5; ++k) T[5 * i + k] = U_[k][i];
    }
    void target(double t, bool corrector, double* rho) {
      std::fill(rho, rho + 5, 0.0);
      each([&](ConeBarrier<3>& cone, const int*) {
        cone.aim(t, corrector);
        const double (*Q)[5] = rows_of(cone);
        for (int i = 0; i < 3; ++i)
          for (int k = 0; k < 5; ++k) rho[k] += Q[i][k] * cone.rho[i];
      });
    }
    void recover(double, const double* z) {
      double dx[5] = {};
      for (int i = 0; i < 5; ++i)
        for (int k = i; k < 5; ++k) dx[i] += R_[i][k] * z[k];
      each([&](ConeBarrier<3>& cone, const int* row) {
        second_order::V<3> rest = cone.rho;
        const double (*Q)[5] = rows_of(cone);
        for (int i = 0; i < 3; ++i) {
          cone.dx[i] = cone.live[i] ? cone.D[i] * dx[row[i]] : 0;
          for (int k = 0; k < 5; ++k) rest[i] -= Q[i][k] * z[k];
        }
        cone.du = cone.W.times(rest);
      });
    }
    double longest_step() {
      double t = INFINITY;
      each([&](ConeBarrier<3>& cone, const int*) { t = std::min(t, cone.longest_step()); });
      return t;
    }
    double gap(double t) {
      double sum = 0;
      each([&](ConeBarrier<3>& cone, const int*) { sum += cone.gap(t); });
      return sum;
    }
    void move(double t) {
      each([&](ConeBarrier<3>& cone, const int*) { cone.move(t); });
    }
    void primal(double* out) {
      std::fill(out, out + 5, 0.0);
      each([&](ConeBarrier<3>& cone, const int* row) {
        for (int k = 0; k < 3; ++k) out[row[k]] = cone.x[k] / cone.D[k];
      });
    }
    void dual(double* out, double t = 0) {
      std::fill(out, out + 5, 0.0);
      each([&](ConeBarrier<3>& cone, const int* row) {
        for (int k = 0; k < 3; ++k) out[row[k]] += (cone.u[k] + t * cone.du[k]) * cone.D[k];
      });
    }

   private:
    template <class F>
    void each(F&& f) {
      static constexpr int rows[2][3] = {{0, 1, 2}, {0, 3, 4}};
      for (int j = 0; j < 2; ++j)
        if (used_[j]) f(cone_[j], rows[j]);
    }
    const double (*rows_of(const ConeBarrier<3>& cone) const)[5] { return Q_ + 3 * (&cone - cone_); }
    // M, into Q: column(cone, k) is W B e of the row k of a cone.
    template <class F>
    void stack(F&& column) {
      for (auto& row : Q_) std::fill(row, row + 5, 0.0);
      each([&](ConeBarrier<3>& cone, const int* row) {
        for (int k = 0; k < 3; ++k) {
          if (!cone.live[k]) continue;
          const second_order::V<3> v = column(cone, k);
          for (int i = 0; i < 3; ++i) Q_[3 * (&cone - cone_) + i][row[k]] = v[i];
        }
      });
    }
    // M = Q U by Gram and Schmidt, twice (Bjorck 1994), and R = U^-1; immobile rows get zeros.
    void factor_stack(double* out) {
      auto& U = U_;
      for (auto& row : U) std::fill(row, row + 5, 0.0);
      const auto along = [&](int j, int k) {
        double sum = 0;
        for (const auto& row : Q_) sum += row[j] * row[k];
        return sum;
      };
      for (int k = 0; k < 5; ++k) {
        for (int twice = 0; twice < 2; ++twice)
          for (int j = 0; j < k; ++j) {
            const double c = along(j, k);
            U[j][k] += c;
            for (auto& row : Q_) row[k] -= c * row[j];
          }
        U[k][k] = std::sqrt(along(k, k));
        for (auto& row : Q_) row[k] = U[k][k] > 0 ? row[k] / U[k][k] : 0;
      }
      for (int k = 0; k < 5; ++k)  // column k of U^-1: U r = e_k by back substitution
        for (int i = 4; i >= 0; --i) {
          double sum = i == k;
          for (int j = i + 1; j <= k; ++j) sum -= U[i][j] * R_[j][k];
          R_[i][k] = i <= k && U[i][i] > 0 ? sum / U[i][i] : 0;
        }
      for (int i = 0; i < 5; ++i) std::copy(R_[i], R_[i] + 5, out + 5 * i);
    }

    ConeBarrier<3> cone_[2];
    bool used_[2];
    double Q_[6][5] = {}, U_[5][5] = {}, R_[5][5] = {};
  };

 private:
  double coefficient(int part) const { return part == 0 ? mu : mu_r; }
  struct Foot {
    double a;        // of the normal
    double size[2];  // |t|, |m|
    bool bound[2];   // whether a disc limits its part
  };
  // As a grows from zero, the part with the smaller |part| / coefficient becomes free first. The other one
  // stays limited, otherwise the point would be inside.
  Foot foot(const double* x) const {
    Foot f{0, {std::sqrt(x[1] * x[1] + x[2] * x[2]), std::sqrt(x[3] * x[3] + x[4] * x[4])}, {true, true}};
    const bool inside = x[0] >= 0 && f.size[0] <= mu * x[0] && f.size[1] <= mu_r * x[0];
    if (inside) return {x[0], {f.size[0], f.size[1]}, {}};
    const auto release = [&](int part) {
      return coefficient(part) > 0 ? f.size[part] / coefficient(part) : INFINITY;
    };
    const auto balance = [&] {
      double sum = x[0], below = 1;
      for (int part = 0; part < 2; ++part) {
        if (!f.bound[part]) continue;
        sum += coefficient(part) * f.size[part];
        below += coefficient(part) * coefficient(part);
      }
      return std::max(0.0, sum / below);
    };
    const int first = release(0) <= release(1) ? 0 : 1;
    f.a = balance();
    if (f.a > release(first)) {
      f.bound[first] = false;
      f.a = balance();
    }
    return f;
  }
};

}  // namespace amontons
