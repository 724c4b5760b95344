#pragma once
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace amontons {

// Anderson acceleration (type II) of a fixed-point iteration t := F(t) with a safeguard. Let g = F(t) - t,
// and let the columns of dG and dF be the last differences of g and of F(t). For an affine F, moving t by the
// combination gamma of past moves changes g by -dG gamma and F(t) by -dF gamma. The next point is therefore
//
//     F(t) - dF gamma,   gamma = argmin |g - dG gamma|,
//
// the image of the point with the smallest residual in that affine space; for a linear map this is equivalent
// to GMRES. Near a point where F is not smooth the differences mislead. If |g| exceeds `tolerated_growth`
// times the last one, the step is undone and the memory cleared. F is non-expansive here, so the plain
// iteration from there is safe.
//
// Sources: Walker, Ni 2011; Zhang, O'Donoghue, Boyd 2020 (safeguarded, for non-expansive maps).
class Anderson {
 public:
  // memory: number of differences kept, at most max_memory; each takes two vectors.
  Anderson(std::size_t size, int memory)
      : memory_(memory),
        dG_(memory, std::vector<double>(size)),
        dF_(dG_),
        g_(size),
        F_(size),
        gram_(memory * memory) {}

  // t, F: the current point and its image. Overwrites t with the next point.
  void advance(std::vector<double>& t, const std::vector<double>& F) {
    const std::size_t n = t.size();
    double norm = 0;
    for (std::size_t i = 0; i < n; ++i) norm += (F[i] - t[i]) * (F[i] - t[i]);
    norm = std::sqrt(norm);
    if (count_ > 0 && norm > tolerated_growth * norm_) {
      t = F_;  // the image of the last accepted point: the plain iteration continues from there
      count_ = 0;
      return;
    }
    if (count_ > 0) {
      const int slot = (count_ - 1) % memory_;
      for (std::size_t i = 0; i < n; ++i) {
        dG_[slot][i] = F[i] - t[i] - g_[i];
        dF_[slot][i] = F[i] - F_[i];
      }
      const int k = std::min(count_, memory_);
      for (int j = 0; j < k; ++j)
        gram_[slot * memory_ + j] = gram_[j * memory_ + slot] = dot(dG_[slot], dG_[j]);
    }
    norm_ = norm;
    for (std::size_t i = 0; i < n; ++i) g_[i] = F[i] - t[i];
    F_ = F;
    t = F;
    const int k = std::min(count_, memory_);
    ++count_;
    if (k == 0) return;
    double gamma[max_memory];
    if (!least_squares(k, gamma)) {
      count_ = 1;  // this point stays, the differences are removed
      return;
    }
    for (int j = 0; j < k; ++j)
      for (std::size_t i = 0; i < n; ++i) t[i] -= gamma[j] * dF_[j][i];
  }
  // Clears the memory; needed when the map has changed.
  void reset() { count_ = 0; }

 private:
  // Differences (count): size of the small matrices on the stack.
  static constexpr int max_memory = 16;
  // The residual of a good step may rise for a while; after a growth beyond two it does not recover.
  static constexpr double tolerated_growth = 2;
  // Differences become parallel near the solution. The number is relative to the trace and so has no unit. It
  // drops combinations shorter than 1e-5 of the longest, which are rounding.
  static constexpr double regularisation = 1e-10;

  static double dot(const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  }

  // (dG'dG + regularisation trace I) gamma = dG'g by Cholesky; false if it breaks down.
  bool least_squares(int k, double* gamma) const {
    double L[max_memory][max_memory], trace = 0;
    for (int j = 0; j < k; ++j) trace += gram_[j * memory_ + j];
    if (!(trace > 0)) return false;
    for (int i = 0; i < k; ++i)
      for (int j = 0; j <= i; ++j) {
        double s = gram_[i * memory_ + j] + (i == j ? regularisation * trace : 0.0);
        for (int q = 0; q < j; ++q) s -= L[i][q] * L[j][q];
        if (i == j && !(s > 0)) return false;
        L[i][j] = i == j ? std::sqrt(s) : s / L[j][j];
      }
    for (int i = 0; i < k; ++i) {
      gamma[i] = dot(dG_[i], g_);
      for (int q = 0; q < i; ++q) gamma[i] -= L[i][q] * gamma[q];
      gamma[i] /= L[i][i];
    }
    for (int i = k - 1; i >= 0; --i) {
      for (int q = i + 1; q < k; ++q) gamma[i] -= L[q][i] * gamma[q];
      gamma[i] /= L[i][i];
    }
    return true;
  }

  // count_: accepted points since the last reset; the next difference goes to slot (count_ - 1) mod memory_.
  int memory_, count_ = 0;
  std::vector<std::vector<double>> dG_, dF_;
  // g and F(t) of the last accepted point, and norm_ = |g|; gram_ = dG'dG, of which a step renews one row.
  std::vector<double> g_, F_, gram_;
  double norm_ = 0;
};

}  // namespace amontons
