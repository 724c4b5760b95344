#pragma once
#include <atomic>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/kinematics/rays.hpp"
#include "amontons/multibody/step/own_method.hpp"
#include "amontons/multibody/step/report.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// Correction of position errors: overlaps, open joints, violated limits.
enum class Recovery : unsigned char {
  // Bodies are displaced, velocities are unchanged, and smooth motion is of second order.
  projection,
  // Correction by velocities in the step's VI (Anitescu, Potra 1997; Tasora, Anitescu 2011). It is of first
  // order, and bodies that are pushed apart keep their speed.
  velocity,
};

// Each field states default, unit and range. A value of 0, "automatic", is derived from the model, so that
// results do not depend on the units.
struct SimulationOptions {
  double dt = 5e-3;  // s, > 0; not tuned: a default
  Law law = Law::coulomb;
  std::string method = "auto";
  // If it is not empty it replaces the method; reports then use the method's name for it.
  StepMethod own_method = {};
  double tolerance = 1e-6;  // natural residual, relative to that of zero impulses; not tuned: a default
  std::size_t max_iterations = 0;  // per solve; 0: the method's own limit
  double budget = infinity;        // s of wall clock per step; results then depend on the machine
  unsigned threads = 0;            // 0: one per core if the problem is large enough
  std::shared_ptr<IterateSource> iterates = {};  // as in Options; null: this library
  // Largest gap (m) up to which contacts are found; 0: a fiftieth of Model::length(). It is wide enough that
  // unforeseen contacts are rare, and narrow enough that few contacts are open.
  double margin = 0;
  Recovery recovery = Recovery::projection;
  // Speed (m/s) of the correction of penetration and joint errors. 0: Model::length() in 0.1 s by projection,
  // in 1 s by velocities, because a faster correction visibly pushes bodies apart.
  double recovery_speed = 0;
  // Speed (m/s) below which impacts do not bounce; 0: 4 |g| dt. A body at rest gains |g| dt before each
  // step's contacts act. An approach at a few times that speed is not an impact.
  double restitution_speed = 0;
  bool warm_start = true;
  // Power of two: a step whose residual exceeds the tolerance is repeated in 2, 4, ... parts.
  unsigned max_substeps = 1;
};

// Impulse of the locked directions of a joint in the last step, including impacts at its start.
struct JointReaction {
  Vec3 point;             // held point of A (origin of frame_a), world, at the start of the step, m
  Vec3 impulse, angular;  // on A, world axes; N s, and N m s about the point
};

// The instant to which forces, reactions, efforts and contacts of a step belong. They are means over the
// step, and fit the pose at its start (of the last substep).
struct StepInstant {
  double time;            // s
  std::vector<double> q;  // generalised coordinates at that time, in the order of Tree
};

// Two geoms, with the bodies that carry them.
struct GeomPair {
  Index body_a, body_b, geom_a, geom_b;
  auto operator<=>(const GeomPair&) const = default;
};
// Pairs that began to carry a contact force in a step, and pairs that ceased to, in order.
struct ContactEvents {
  std::vector<GeomPair> began, ended;
};

class StepClock;      // wall clock and budget of a step, step/report_sums.hpp
struct Assembly;      // how a step becomes a problem, step/assemble.hpp
struct JointOptions;  // joints/rows.hpp
class Tree;           // generalised coordinates, kinematics/tree.hpp
struct StepScratch;   // memory of a step, step/scratch.hpp
struct Forest;        // bodies that move in coordinates, trees/forest.hpp
struct StepSolver;    // method, options and clock of its solves, step/solve_step.hpp

// A model in motion: its state, and the results of the last step. Steps are deterministic: the same state and
// options give the same bits for any number of threads, unless there is a budget.
class Simulation {
 public:
  Simulation(std::shared_ptr<const Model> model, SimulationOptions options);
  explicit Simulation(Model model, SimulationOptions options = {})
      : Simulation(std::make_shared<const Model>(std::move(model)), std::move(options)) {}
  // A copy continues bit for bit. It shares only constant data: the model and the last problem.
  Simulation(const Simulation& other);
  // `other` must have the same model; the state's arrays keep their memory.
  Simulation& operator=(const Simulation& other);
  ~Simulation();

  // Returns to the initial state, as if no step had been made.
  void reset();

  // Advances the state by dt. Throws InputError if the state, forces or controls are invalid (then nothing
  // has changed), or if another thread is in a step of this simulation. If velocities are not finite, or the
  // Budget of the thread was interrupted, the state is put back and the status says so.
  Report step();
  // Makes at least one and at most `steps` steps. Ends after a step that is not sound, and after `seconds` of
  // wall clock.
  struct Run {
    Report report;          // of the last step
    std::size_t steps = 0;  // number of steps made
    double residual = 0;    // largest residual of their reports
  };
  Run run(std::size_t steps, double seconds = infinity);
  // Whether a thread is in a step: only that thread may access data that the step changes.
  bool stepping() const { return stepping_.load(std::memory_order_acquire); }

  const Model& model() const { return *model_; }
  const SimulationOptions& options() const { return options_; }
  State& state() { return state_; }
  const State& state() const { return state_; }
  // The tree of joints that place the bodies, and the order of State::joint_forces.
  const Tree& tree() const { return *tree_; }
  // The instant to which the forces of the last step belong. InputError before the first step.
  StepInstant instant() const;
  // The state at the start of the last step; without bodies before the first step.
  const State& last_state() const;
  // Contacts of the last step or substep, including open ones.
  const std::vector<Contact>& contacts() const { return contacts_; }
  // Contacts of one body, or between two, by index or name, "world" included. The first body is A: normals
  // and impulses are those on it. `local` stays that of the contact in contacts().
  std::vector<Contact> contacts_of(Reference body) const;
  std::vector<Contact> contacts_between(Reference a, Reference b) const;
  // Mean over the last step of the sum of the contact forces on a body, world axes (N).
  Vec3 contact_force(Reference body) const;
  // Changes between the last two steps, impacts included; empty after a failed step.
  ContactEvents contact_events() const;
  // The first geom that a ray meets in the present state. A ray from inside a shape hits where it leaves.
  // Planes are hit on the upper side only. The direction may have any length but zero. The ray passes through
  // excluded bodies.
  GeomHit ray(const Vec3& origin, const Vec3& direction, std::initializer_list<Reference> exclude = {}) const;
  // One per joint; empty before the first step.
  const std::vector<JointReaction>& joint_reactions() const { return reactions_; }
  // The VI of the last step or substep, and its solution; empty before the first step.
  const std::shared_ptr<const Problem>& problem() const { return problem_; }
  const std::vector<double>& impulses() const { return x_; }
  // The options, with automatic values replaced by the derived ones.
  double margin() const;
  double recovery_speed() const;
  double restitution_speed() const;

 private:
  // An attempt at a step: the number of parts; whether it is damped; whether it is the last attempt. A damped
  // attempt is of first order and may lose but never gain energy.
  struct Attempt {
    unsigned parts;
    bool damped, recovers, is_last;
  };
  void make_step(Report& report);
  void finish_report(Report& report);
  bool try_step(const Attempt& attempt, StepClock& clock, Report& report);
  // The calls of a step of length h (s), step/step.cpp. `search`: time of a search for contacts (s).
  // `recovery`: speed (m/s) of the correction of position errors by velocities. False, with only scratch
  // changed, if the step created energy and another attempt follows.
  bool advance(double h, const Attempt& attempt, StepClock& clock, Report& report);
  void make_free(double h, bool damped);
  void observe(double h, bool damped, StepClock& clock, Report& report);
  bool correct(double h, bool damped, const JointOptions& options, double search, StepClock& clock,
               Report& report);
  void foresee_impulses(double h);
  Assembly pose_problem(double h, bool damped, double recovery, const JointOptions& options,
                        const StepClock& clock, double search);
  bool keep_balance(const Assembly& assembly, const Attempt& attempt, double recovery, StepSolver& solver,
                    Report& report);
  void move_on(double h);
  void note_touching(bool advanced);

  State first_state() const;

  std::shared_ptr<const Model> model_;
  std::shared_ptr<const Tree> tree_;
  std::shared_ptr<const Forest> forest_;
  SimulationOptions options_;
  State state_;
  std::vector<Contact> contacts_;
  std::vector<GeomPair> touching_, touched_;  // with a force in the last step, and in the one before
  std::vector<JointReaction> reactions_;
  std::shared_ptr<const Problem> problem_;
  std::vector<double> x_;
  std::unique_ptr<StepScratch> scratch_;
  std::atomic<bool> stepping_{false};
};

}  // namespace amontons
