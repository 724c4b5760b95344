#pragma once
#include <atomic>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/kinematics/rays.hpp"
#include "amontons/multibody/step/report.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// How errors of position (overlaps, joints that came apart, violated limits) are taken back.
enum class Recovery : unsigned char {
  // Bodies are moved, velocities are not changed, and smooth motion is of second order.
  projection,
  // By velocities that are part of the step's VI (Anitescu, Potra 1997; Tasora, Anitescu 2011): of first
  // order, and what is pushed apart keeps its speed.
  velocity,
};

// Every field: default, unit, range. Fields of 0 that say "automatic" follow from the model, so that results
// do not depend on the units.
struct SimulationOptions {
  double dt = 5e-3;  // s, > 0; not tuned: a default
  Law law = Law::coulomb;
  std::string method = "auto";
  double tolerance = 1e-6;  // natural residual, relative to that of zero impulses; not tuned: a default
  std::size_t max_iterations = 0;           // per solve; 0: the method's own limit
  double budget = infinity;                 // s of wall clock per step; results then depend on the machine
  unsigned threads = 0;                     // 0: one per core, where the problem is large enough
  std::shared_ptr<IterateSource> iterates;  // as in Options; null: this library
  // m, contacts are found up to this gap; 0: a fiftieth of Model::length(). Wide enough that what a step
  // cannot foresee rarely matters, narrow enough that few contacts are open.
  double margin = 0;
  Recovery recovery = Recovery::projection;
  // m/s, of the correction of penetration and joint errors; 0: Model::length() in 0.1 s by projection, in 1 s
  // by velocities, as what is faster pushes bodies apart visibly.
  double recovery_speed = 0;
  // m/s, slower impacts do not bounce; 0: 4 |g| dt. A body at rest gains |g| dt before each step's contacts
  // act; below a few times that, an approach is no impact.
  double restitution_speed = 0;
  bool warm_start = true;
  // Power of two: a step whose residual stays above the tolerance is redone in 2, 4, ... parts.
  unsigned max_substeps = 1;
};

// What the locked directions of a joint did in the last step, with what impacts at its start added.
struct JointReaction {
  Vec3 point;             // where A holds the joint (origin of frame_a), world, at the start of the step, m
  Vec3 impulse, angular;  // on A, world axes, the second about the point, N s and N m s
};

// Two geoms, with the bodies that carry them.
struct GeomPair {
  Index body_a, body_b, geom_a, geom_b;
  auto operator<=>(const GeomPair&) const = default;
};
// Which pairs began to carry a contact force in a step, and which ceased to, in order.
struct ContactEvents {
  std::vector<GeomPair> began, ended;
};

class StepClock;      // wall clock and budget of a step, step/report_sums.hpp
struct Assembly;      // how a step becomes a problem, step/assemble.hpp
struct JointOptions;  // joints/rows.hpp
struct StepScratch;   // memory of a step, step/scratch.hpp
struct StepSolver;    // method, options and clock of its solves, step/solve_step.hpp

// A model in motion: its state, and what the last step found. Steps are deterministic: the same state and
// options give the same bits, whatever the number of threads, unless there is a budget.
class Simulation {
 public:
  Simulation(std::shared_ptr<const Model> model, SimulationOptions options);
  explicit Simulation(Model model, SimulationOptions options = {})
      : Simulation(std::make_shared<const Model>(std::move(model)), std::move(options)) {}
  // A copy goes on bit for bit, and shares only what never changes: the model and the last problem.
  Simulation(const Simulation& other);
  // Of the same model; the memory of the state's arrays stays.
  Simulation& operator=(const Simulation& other);
  ~Simulation();

  // Back to the initial state, as if there had been no step.
  void reset();

  // Advances the state by dt. Throws InputError if the state, forces or targets are not usable (then nothing
  // has changed), or if another thread is in a step of this simulation. When velocities come out not finite,
  // or the Patience of the thread was interrupted, the state is put back and the status says so.
  Report step();
  // At least one and at most `steps` steps; ends after one that is not sound, and after so many seconds of
  // wall clock.
  struct Run {
    Report report;          // of the last step
    std::size_t steps = 0;  // that were made
    double residual = 0;    // the largest of their reports
  };
  Run run(std::size_t steps, double seconds = infinity);
  // Whether a thread is in a step: only it may use what the step changes.
  bool stepping() const { return stepping_.load(std::memory_order_acquire); }

  const Model& model() const { return *model_; }
  const SimulationOptions& options() const { return options_; }
  State& state() { return state_; }
  const State& state() const { return state_; }
  // The state at the start of the last step; without bodies before the first one.
  const State& last_state() const;
  // Of the last step (the last substep), open ones included.
  const std::vector<Contact>& contacts() const { return contacts_; }
  // Of a body, or of two, by index or name, "world" included. The body, or the first, is A: normals and
  // impulses are those on it. `local` stays that of the contact in contacts().
  std::vector<Contact> contacts_of(Reference body) const;
  std::vector<Contact> contacts_between(Reference a, Reference b) const;
  // The sum of the contact forces on a body, a mean over the last step, world axes, N.
  Vec3 contact_force(Reference body) const;
  // Between the last step and the one before it, impacts included; none after a step that failed.
  ContactEvents contact_events() const;
  // The first geom that a ray meets in the present state: from inside a shape where it leaves, of planes the
  // upper side only. The direction may have any length but zero. The ray passes through excluded bodies.
  GeomHit ray(const Vec3& origin, const Vec3& direction, std::initializer_list<Reference> exclude = {}) const;
  // One per joint; empty before the first step.
  const std::vector<JointReaction>& joint_reactions() const { return reactions_; }
  // The VI of the last step (the last substep), and its solution; empty before the first step.
  const std::shared_ptr<const Problem>& problem() const { return problem_; }
  const std::vector<double>& impulses() const { return x_; }
  // The options, with the values that automatic ones stand for.
  double margin() const;
  double recovery_speed() const;
  double restitution_speed() const;

 private:
  // An attempt at a step: in so many parts; of first order, which loses energy and never gains any; the last
  // one.
  struct Attempt {
    unsigned parts;
    bool damped, recovers, is_last;
  };
  void make_step(Report& report);
  void finish_report(Report& report);
  bool try_step(const Attempt& attempt, StepClock& clock, Report& report);
  // The calls of a step of length h (s), step/step.cpp. `search`: s that a search for contacts takes.
  // `recovery`: m/s by which velocities take back errors of position. False, with nothing changed but
  // scratch, where the step made energy from nothing and another attempt follows.
  bool advance(double h, const Attempt& attempt, StepClock& clock, Report& report);
  void observe(double h, bool damped, StepClock& clock, Report& report);
  bool correct(double h, bool damped, const JointOptions& options, double search, StepClock& clock,
               Report& report);
  Assembly pose_problem(double h, bool damped, double recovery, const JointOptions& options,
                        const StepClock& clock, double search);
  bool keep_balance(const Assembly& assembly, const Attempt& attempt, double recovery, StepSolver& solver,
                    Report& report);
  void move_on(double h);
  void note_touching(bool advanced);

  std::shared_ptr<const Model> model_;
  SimulationOptions options_;
  State state_;
  std::vector<Contact> contacts_;
  std::vector<GeomPair> touching_, touched_;  // with a force in the last step, in the one before
  std::vector<JointReaction> reactions_;
  std::shared_ptr<const Problem> problem_;
  std::vector<double> x_;
  std::unique_ptr<StepScratch> scratch_;
  std::atomic<bool> stepping_{false};
};

}  // namespace amontons
