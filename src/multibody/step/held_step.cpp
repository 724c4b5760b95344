// The method of a held step replaces that of the solve, as a user's own method does. The step around it stays
// as it is. So positions, second-order terms and all that a step does beside its problem are differentiated
// with it. A problem that a step poses before its last one (an impact, a look ahead) has other rows. It is
// solved as usual, and counted.
#include "amontons/multibody/step/held_step.hpp"

#include <algorithm>
#include <mutex>
#include <optional>

#include "amontons/base/error.hpp"
#include "amontons/solvers/second_order/held_faces.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

// Copies of a simulation step side by side and share the faces.
struct HeldStep::Shared {
  HeldFaces faces;
  std::mutex mutex;
  std::size_t others = 0;
  double residual = 0;

  Shared(const Problem& problem, Law law, std::vector<double> x) : faces(problem, law, std::move(x)) {}
};

HeldStep::HeldStep(const Simulation& simulation) {
  AMONTONS_REQUIRE(simulation.state().steps > 0 && !simulation.last_state().positions.empty(),
                   "there was no step yet that could be held; call step() first");
  const Law law = simulation.options().law;
  const auto& problem = simulation.problem();
  // A step without rows has no problem, and no faces.
  shared_ = problem && simulation.impulses().size() == problem->rows()
                ? std::make_shared<Shared>(*problem, law, simulation.impulses())
                : std::make_shared<Shared>(Problem{}, law, std::vector<double>{});
}

SimulationOptions HeldStep::options(SimulationOptions given, double reach) const {
  given.own_method = [shared = shared_](const Problem& problem, const Options& options) {
    std::optional<HeldFaces::Nearby> near = shared->faces.solve(problem);
    if (!near) {
      const std::lock_guard lock(shared->mutex);
      ++shared->others;
    }
    if (!near) return solve(problem, "auto", options).x;
    const std::lock_guard lock(shared->mutex);
    shared->residual = std::max(shared->residual, near->residual);
    return std::move(near->x);
  };
  given.held = reach;
  given.warm_start = false;  // a start within the tolerance would be taken for the solution
  given.max_substeps = 1;
  given.threads = 1;
  return given;
}

double HeldStep::margin() const { return shared_->faces.margin(); }
bool HeldStep::determines_velocities() const { return shared_->faces.determines_velocities(); }
std::size_t HeldStep::rows() const { return shared_->faces.rows(); }
std::size_t HeldStep::others() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->others;
}
double HeldStep::residual() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->residual;
}

}  // namespace amontons
