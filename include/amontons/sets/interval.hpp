#pragma once
#include "amontons/sets/barrier.hpp"
#include "amontons/sets/set.hpp"

namespace amontons {

// [lo, hi]: a motor or a joint friction with limited effort; either bound may be infinite. It is a cone only
// if its bounds are 0 or infinite. In place of the dual cone it has the normal cone at the projection.
struct Interval {
  static constexpr int dim = 1;
  static constexpr const char* name = "interval";
  static constexpr bool is_cone = false, frictional = false;
  double lo, hi;

  void project(const double* x, double* out) const { out[0] = x[0] < lo ? lo : (x[0] > hi ? hi : x[0]); }
  void project_recession(const double* d, double* out) const {
    out[0] = (d[0] > 0 && std::isinf(hi)) || (d[0] < 0 && std::isinf(lo)) ? d[0] : 0.0;
  }
  void natural_map(const double* x, const double* step, double* out) const {
    const double trial = x[0] - step[0];
    out[0] = trial < lo ? x[0] - lo : (trial > hi ? x[0] - hi : step[0]);
  }
  Face<1> face(const double* y) const { return face_of_all<1>(y[0] >= lo && y[0] <= hi); }
  // u is balanced against the bounds, so only the natural map of an interval measures an error.
  double violation(const double*) const { return 0; }
  std::string complaint(std::size_t i) const {
    const std::string where = "interval " + std::to_string(i);
    if (std::isnan(lo) || std::isnan(hi)) return where + ": a bound is NaN; use -inf or inf for no bound";
    if (!(lo <= hi))
      return where + ": lo = " + std::to_string(lo) + " is above hi = " + std::to_string(hi) + "; swap them";
    if (!(lo < INFINITY && hi > -INFINITY)) return where + " is empty: a bound is infinite on the wrong side";
    return {};
  }

  // x - lo >= 0 and hi - x >= 0 with a multiplier each, u = z_lo - z_hi. Equal bounds leave a constant,
  // infinite ones a free row.
  class Barrier {
   public:
    Barrier(const Interval& set, double unit)
        : lo_(set.lo / unit), hi_(set.hi / unit), below_(std::isfinite(lo_)), above_(std::isfinite(hi_)) {
      open_ = !below_ && !above_;
      fixed_ = lo_ == hi_;
      x_ = below_ && above_ ? 0.5 * (lo_ + hi_) : below_ ? lo_ + 1 : above_ ? hi_ - 1 : 0;
      z_lo_ = below_;
      z_hi_ = above_;
    }

    double degree() const { return fixed_ ? 0 : below_ + above_; }
    void start_factor(double* R) const { R[0] = open_ ? 1 / std::sqrt(BilateralBarrier::proximal) : 0; }
    void start(const double* solution) {
      if (open_) x_ = solution[0];
    }
    void worst(double&, double&) const {}
    void push(double, double) {}
    void factor(double* R) {
      if (boxed()) {
        double w2 = 0;
        if (below_) w2 += z_lo_ / (x_ - lo_);
        if (above_) w2 += z_hi_ / (hi_ - x_);
        R_ = 1 / std::sqrt(w2);
      } else {
        start_factor(&R_);
      }
      R[0] = R_;
    }
    void dual_factor(double* T) const { T[0] = R_ > 0 ? 1 / R_ : 0; }
    void target(double mu, bool corrector, double* rho) {
      rho[0] = 0;
      if (!boxed()) return;
      second_lo_ = corrector ? dx_ * dz_lo_ : 0;
      second_hi_ = corrector ? -dx_ * dz_hi_ : 0;
      double aim = z_hi_ - z_lo_;
      if (below_) aim += (mu - second_lo_) / (x_ - lo_);
      if (above_) aim -= (mu - second_hi_) / (hi_ - x_);
      rho[0] = aim * R_;
    }
    void recover(double mu, const double* z) {
      dx_ = R_ * z[0];
      if (!boxed()) return;
      if (below_) dz_lo_ = (mu - second_lo_ - z_lo_ * dx_) / (x_ - lo_) - z_lo_;
      if (above_) dz_hi_ = (mu - second_hi_ + z_hi_ * dx_) / (hi_ - x_) - z_hi_;
    }
    double longest_step() const {
      double t = std::numeric_limits<double>::infinity();
      if (!boxed()) return t;
      const auto ray = [&t](double v, double dv) {
        if (dv < 0) t = std::min(t, -v / dv);
      };
      ray(x_ - lo_, dx_);
      ray(hi_ - x_, -dx_);
      ray(z_lo_, dz_lo_);
      ray(z_hi_, dz_hi_);
      return t;
    }
    double gap(double t) const {
      if (!boxed()) return 0;
      const double x = x_ + t * dx_;
      double sum = 0;
      if (below_) sum += (x - lo_) * (z_lo_ + t * dz_lo_);
      if (above_) sum += (hi_ - x) * (z_hi_ + t * dz_hi_);
      return sum;
    }
    void move(double t) {
      x_ += t * dx_;
      z_lo_ += t * dz_lo_;
      z_hi_ += t * dz_hi_;
    }
    void primal(double* out) const { out[0] = x_; }
    void dual(double* out) const { out[0] = boxed() ? z_lo_ - z_hi_ : 0; }

   private:
    bool boxed() const { return !open_ && !fixed_; }
    double lo_, hi_;
    bool below_, above_, open_, fixed_;
    double x_ = 0, z_lo_ = 0, z_hi_ = 0, dx_ = 0, dz_lo_ = 0, dz_hi_ = 0;
    double second_lo_ = 0, second_hi_ = 0, R_ = 0;
  };
};

}  // namespace amontons
