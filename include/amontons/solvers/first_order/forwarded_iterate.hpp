#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "amontons/solvers/driver/options.hpp"
#include "amontons/solvers/first_order/device_method.hpp"
#include "amontons/solvers/first_order/iterate.hpp"

namespace amontons {

// The passes of the concept Iterate as an interface, for an iterate that is unknown when this library is
// compiled: that of a user, or a Python object. One virtual call per pass, none per contact. Meaning and
// order of the passes are those of iterate.hpp; spans are in the order and the frames of the problem.
class AnyIterate {
 public:
  virtual ~AnyIterate() = default;
  virtual double start(std::span<const double> x0) = 0;
  virtual double refresh() = 0;
  virtual Direction direction(double alpha) = 0;
  virtual double curvature() = 0;
  virtual Update update(double lambda) = 0;
  virtual void start_momentum() = 0;
  virtual MomentumDirection momentum_direction(double alpha) = 0;
  virtual double accelerate(double beta) = 0;
  virtual double refresh_momentum() = 0;
  virtual void keep_best() = 0;
  virtual void extract_best(std::span<double> x) const = 0;
  virtual void extract(std::span<double> x) const = 0;
  virtual double objective() const = 0;
};

// Source of iterates for P-SPG-FB and APGD in place of this library: Options::iterates. All solves with these
// options share it, and several may run at a time.
struct IterateSource {
  // The name in Solution::device.
  std::string name;
  // Whether it serves a problem; other problems stay on the processor.
  std::function<bool(const Problem&)> takes;
  // One of the two makes what a solve needs: passes, or whole iterations. The problem outlives it.
  std::function<std::unique_ptr<AnyIterate>(const Problem&, Law)> make;
  std::function<std::unique_ptr<AnyMethod>(const Problem&, Law, unsigned threads)> make_method;
};

inline bool on_device(const Problem& problem, const Options& options) {
  return options.iterates && options.iterates->takes(problem);
}
// Solution::device of a solve by P-SPG-FB or APGD.
inline std::string device_of(const Problem& problem, const Options& options) {
  return on_device(problem, options) ? options.iterates->name : "cpu";
}

// An Iterate that forwards every pass.
class ForwardedIterate {
 public:
  explicit ForwardedIterate(std::unique_ptr<AnyIterate> passes) : passes_(std::move(passes)) {}

  double start(std::span<const double> x0) { return passes_->start(x0); }
  double refresh() { return passes_->refresh(); }
  Direction direction(double alpha) { return passes_->direction(alpha); }
  double curvature() { return passes_->curvature(); }
  Update update(double lambda) { return passes_->update(lambda); }
  void start_momentum() { passes_->start_momentum(); }
  MomentumDirection momentum_direction(double alpha) { return passes_->momentum_direction(alpha); }
  double accelerate(double beta) { return passes_->accelerate(beta); }
  double refresh_momentum() { return passes_->refresh_momentum(); }
  void keep_best() { passes_->keep_best(); }
  void extract_best(std::span<double> x) const { passes_->extract_best(x); }
  void extract(std::span<double> x) const { passes_->extract(x); }
  double objective() const { return passes_->objective(); }

 private:
  std::unique_ptr<AnyIterate> passes_;
};
static_assert(Iterate<ForwardedIterate>);

}  // namespace amontons
