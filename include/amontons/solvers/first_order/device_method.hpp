#pragma once
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace amontons {

// Sums of an iteration on a device. map: the squared natural map at the new x. step, backtracks: for the
// history. difference: the objective less that of the start (P-SPG-FB). dAd, dPd: <d, A d>, <d, P d>. trials:
// directions that were tried.
struct IterationSums {
  double map, step, backtracks, difference, dAd, dPd, trials;
};

// P-SPG-FB or APGD made by a device, which keeps vectors and scalars and makes many iterations before anybody
// is asked. Its iterates are those of spg.cpp and apgd.cpp over the passes of the same device, bit by bit.
class AnyMethod {
 public:
  // Scalars of the method by the names of kernels.cl.
  using Settings = std::vector<std::pair<std::string, double>>;

  virtual ~AnyMethod() = default;
  // x = x0, which lies in K; returns the squared natural map.
  virtual double start(const char* method, std::span<const double> x0, const Settings& settings) = 0;
  // Makes at most `most` iterations and writes their sums; none if no direction descends. It also ends with
  // an iteration that meets the tolerance, and where u is to be formed from scratch. It keeps the best x.
  virtual void advance(std::size_t most, std::vector<IterationSums>& sums) = 0;
  // Forms u from scratch; returns the squared natural map.
  virtual double refresh() = 0;
  virtual void extract_best(std::span<double> x) const = 0;
  virtual void extract(std::span<double> x) const = 0;
  virtual double objective() const = 0;
};

}  // namespace amontons
