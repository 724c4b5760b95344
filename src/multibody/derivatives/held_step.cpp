// The method of a held step replaces that of the solve, as a user's own method does. The step around it stays
// as it is. So positions, second-order terms and all that a step does beside its problem are differentiated
// with it. A step may pose several problems: those of impacts, and one with contacts that come into reach.
// Each has faces of its own, which the first held step finds. A problem of a later step that none of them is
// like is solved as usual, and counted.
#include "amontons/multibody/derivatives/held_step.hpp"

#include <algorithm>
#include <limits>
#include <mutex>
#include <vector>

#include "amontons/base/error.hpp"
#include "amontons/base/policy.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/derivatives/held_faces.hpp"

namespace amontons {

namespace {

// Iterations for a problem whose derivative is not one.
constexpr std::size_t enough = 30;  // not tuned: a solve of a step takes tens

}  // namespace

// Copies of a simulation step side by side and share the faces, which do not change once they are closed.
struct HeldStep::Shared {
  Law law;
  std::vector<std::unique_ptr<HeldFaces>> faces;
  double length = 0;   // of the model (m)
  double fall = 0;     // |g| of the model (m/s^2)
  double closing = 0;  // with which a step closes the overlaps that changes make (m/s)
  bool closed = false;
  std::mutex mutex;
  std::size_t others = 0;
  double residual = 0;

  void add(const Problem& problem, std::vector<double> x) {
    faces.push_back(std::make_unique<HeldFaces>(problem, law, std::move(x)));
  }
  // The faces of the most alike problem; null if there are none.
  const HeldFaces* nearest(const Problem& problem) const {
    const HeldFaces* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& one : faces)
      if (const double apart = one->distance(problem, closing); apart < least) {
        least = apart;
        best = one.get();
      }
    return best;
  }
  std::vector<double> solve(const Problem& problem, const Options& options) {
    if (const HeldFaces* known = nearest(problem)) {
      HeldFaces::Nearby near = known->solve(problem);
      const std::lock_guard lock(mutex);
      residual = std::max(residual, near.residual);
      return std::move(near.x);
    }
    // One that is not held is counted, and its solution needs no digits: the solve of a step has limits of
    // work, which this one has not.
    Options rough = options;
    if (closed) {
      rough.tolerance = std::max(options.tolerance, Options{}.tolerance);
      rough.max_iterations = enough;
    }
    std::vector<double> x = amontons::solve(problem, "auto", rough).x;
    const std::lock_guard lock(mutex);
    if (closed)
      ++others;
    else
      add(problem, x);
    return x;
  }
};

HeldStep::HeldStep(const Simulation& simulation) : shared_(std::make_shared<Shared>()) {
  AMONTONS_REQUIRE(simulation.state().steps > 0 && !simulation.last_state().positions.empty(),
                   "there was no step yet that could be held; call step() first");
  shared_->law = simulation.options().law;
  shared_->length = simulation.model().length();
  shared_->fall = norm(simulation.model().description().gravity);
  const auto& problem = simulation.problem();
  // A step without rows has no problem, and no faces.
  if (problem && simulation.impulses().size() == problem->rows())
    shared_->add(*problem, simulation.impulses());
}

SimulationOptions HeldStep::options(SimulationOptions given, double reach) const {
  shared_->closing = reach * shared_->length / given.dt;
  given.own_method = [shared = shared_](const Problem& problem, const Options& options) {
    return shared->solve(problem, options);
  };
  given.trusts_method = true;
  // Beside them, the overlaps that a contact at rest has.
  given.closing_at_once = base::policy.three_digits * given.dt * shared_->fall + shared_->closing;
  given.warm_start = false;  // a start within the tolerance would be taken for the solution
  given.max_substeps = 1;
  given.threads = 1;
  return given;
}

void HeldStep::close() { shared_->closed = true; }

double HeldStep::margin() const {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& one : shared_->faces) least = std::min(least, one->margin());
  return least;
}
bool HeldStep::determines_velocities() const {
  const auto& faces = shared_->faces;
  return std::all_of(faces.begin(), faces.end(),
                     [](const auto& one) { return one->determines_velocities(); });
}
std::size_t HeldStep::others() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->others;
}
double HeldStep::residual() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->residual;
}

}  // namespace amontons
