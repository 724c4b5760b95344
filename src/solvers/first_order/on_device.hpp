// Private: a method of the driver whose iterations a device makes.
#pragma once
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/first_order/device_method.hpp"

namespace amontons {

// Kind: name, limits, products of a refresh, and settings(options), the scalars at the start. The driver sees
// the iterations one by one, and the device is ahead of it by at most one reading. If a limit ends the solve
// in between, the device may hold a better x than the last one that was seen: the answer is measured in the
// end.
template <class Kind>
class OnDevice {
 public:
  static constexpr const char* name = Kind::name;
  static constexpr Limits limits = Kind::limits;

  OnDevice(const Options& options, Monitor& monitor, std::unique_ptr<AnyMethod> method)
      : options_(options), monitor_(monitor), method_(std::move(method)) {}

  double start(const Start& s) {
    AnyMethod::Settings settings = Kind::settings(options_);
    settings.insert(settings.end(), {{"tolerance", options_.tolerance},
                                     {"scale", s.scale},
                                     {"at_start", s.map / s.scale},
                                     {"period", static_cast<double>(limits.refresh_period)}});
    const double map = method_->start(name, s.x, settings);
    ++monitor_.products;
    if (watched()) f0_ = method_->objective();
    return std::sqrt(map);
  }

  std::optional<double> step() {
    if (next_ == sums_.size()) {
      next_ = 0;
      sums_.clear();
      // Who watches sees the objective of every iterate, so that no iterate may be left behind.
      method_->advance(watched() ? 1 : monitor_.left(), sums_);
      if (sums_.empty()) return std::nullopt;
    }
    now_ = sums_[next_++];
    monitor_.products += static_cast<std::size_t>(now_.trials);
    require_curvature(now_.dAd, now_.dPd);
    return std::sqrt(now_.map);
  }

  double refresh() {
    monitor_.products += Kind::refresh_products;
    return std::sqrt(method_->refresh());
  }
  void keep_best() {}  // the device did
  void best(std::vector<double>& x) const { method_->extract_best(x); }
  void last(std::vector<double>& x) const { method_->extract(x); }
  double objective() const { return Kind::sums_objective ? f0_ + now_.difference : method_->objective(); }
  double step_size() const { return now_.step; }
  std::size_t backtracks() const { return static_cast<std::size_t>(now_.backtracks); }

 private:
  bool watched() const { return options_.history || options_.callback; }

  const Options& options_;
  Monitor& monitor_;
  std::unique_ptr<AnyMethod> method_;
  std::vector<IterationSums> sums_;
  std::size_t next_ = 0;
  IterationSums now_{0, 1, 0, 0, 0, 0, 0};  // both methods begin with a step of 1
  double f0_ = 0;
};

}  // namespace amontons
