#include "amontons/sets/product.hpp"

#include <cmath>
#include <string>

#include "amontons/base/error.hpp"

namespace amontons {

void SetProduct::append(SetKind kind, std::size_t count, std::size_t param, std::size_t dim) {
  if (count == 0) return;
  if (!runs_.empty() && runs_.back().kind == kind)
    runs_.back().count += count;
  else
    runs_.push_back({kind, count, rows_, blocks_, param});
  rows_ += count * dim;
  blocks_ += count;
}

void SetProduct::add_free(std::size_t count) { append(SetKind::free, count, 0, 1); }

void SetProduct::add_nonnegative(std::size_t count) { append(SetKind::nonnegative, count, 0, 1); }

void SetProduct::add_interval(std::span<const double> lo, std::span<const double> hi) {
  AMONTONS_REQUIRE(lo.size() == hi.size(), "interval: lo has " + std::to_string(lo.size()) +
                                               " entries and hi " + std::to_string(hi.size()) +
                                               "; give one of each per row");
  for (std::size_t i = 0; i < lo.size(); ++i) {
    const std::string where = "interval " + std::to_string(i);
    AMONTONS_REQUIRE(!std::isnan(lo[i]) && !std::isnan(hi[i]),
                     where + ": a bound is NaN; use -inf or inf for no bound");
    AMONTONS_REQUIRE(lo[i] <= hi[i], where + ": lo = " + std::to_string(lo[i]) +
                                         " is above hi = " + std::to_string(hi[i]) + "; swap them");
    AMONTONS_REQUIRE(lo[i] < INFINITY && hi[i] > -INFINITY,
                     where + " is empty: a bound is infinite on the wrong side");
  }
  append(SetKind::interval, lo.size(), lo_.size(), 1);
  lo_.insert(lo_.end(), lo.begin(), lo.end());
  hi_.insert(hi_.end(), hi.begin(), hi.end());
}

void SetProduct::add_friction(std::span<const double> mu) {
  for (std::size_t i = 0; i < mu.size(); ++i)
    AMONTONS_REQUIRE(mu[i] >= 0 && std::isfinite(mu[i]), "friction coefficient mu[" + std::to_string(i) +
                                                             "] = " + std::to_string(mu[i]) +
                                                             "; it must be finite and not negative");
  append(SetKind::friction, mu.size(), mu_.size(), 3);
  mu_.insert(mu_.end(), mu.begin(), mu.end());
}

bool SetProduct::all_free() const {
  for (const SetRun& run : runs_)
    if (run.kind != SetKind::free) return false;
  return true;
}

void project(const SetProduct& K, std::span<const double> x, std::span<double> out) {
  for_each_block(K, [&](const auto& set, std::size_t, std::size_t row) { set.project(&x[row], &out[row]); });
}

double distance(const SetProduct& K, std::span<const double> x) {
  double sum = 0;
  for_each_block(K, [&]<class Set>(const Set& set, std::size_t, std::size_t row) {
    double foot[Set::dim];
    set.project(&x[row], foot);
    for (int k = 0; k < Set::dim; ++k) sum += (x[row + k] - foot[k]) * (x[row + k] - foot[k]);
  });
  return std::sqrt(sum);
}

void project_polar(const SetProduct& K, std::span<const double> x, std::span<double> out) {
  for_each_block(K, [&]<class Set>(const Set& set, std::size_t, std::size_t row) {
    double foot[Set::dim];
    set.project(&x[row], foot);
    for (int k = 0; k < Set::dim; ++k) out[row + k] = x[row + k] - foot[k];
  });
}

}  // namespace amontons
