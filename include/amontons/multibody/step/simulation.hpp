#pragma once
#include <atomic>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/contacts/sleepers.hpp"
#include "amontons/multibody/kinematics/rays.hpp"
#include "amontons/multibody/step/report.hpp"
#include "amontons/multibody/step/simulation_options.hpp"

namespace amontons {

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

// Pairs that began to carry a contact force in a step, and pairs that ceased to, in order.
struct ContactEvents {
  std::vector<GeomPair> began, ended;
};

class StepClock;        // wall clock and budget of a step, step/clock.hpp
class Tree;             // generalised coordinates, kinematics/tree.hpp
struct PositionErrors;  // at the start of a step, step/observe.hpp
struct StepScratch;     // memory of a step, step/scratch.hpp
struct StepSetting;     // constant during a step, step/setting.hpp
struct StepSums;        // solves of a step, step/report_sums.hpp

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
  double instant_time() const;  // s, of that instant
  // The state at the start of the last step; without bodies before the first step.
  const State& last_state() const;
  // Contacts of the last step or substep, including open ones.
  const std::vector<Contact>& contacts() const;
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
  const std::vector<JointReaction>& joint_reactions() const { return last_.reactions; }
  // The VI of the last step or substep, and its solution; empty before the first step. A step that left out
  // islands asleep is made again without sleep for them, with the same bits.
  const std::shared_ptr<const Problem>& problem() const { return whole().problem; }
  const std::vector<double>& impulses() const { return whole().x; }
  // Number of bodies asleep: the next step leaves their islands out, unless something wakes them.
  std::size_t sleeping() const;
  // Generalised accelerations along qd, of which the forces of the last step are the cause: means from the
  // middle of the step before to that of the last one. Zeros before the first step.
  std::vector<double> accelerations() const;
  // For derivatives of a step, which map the velocities that it begins with to those of the next one.
  //
  // Shows them in the state, in place of those of the instant.
  void show_middle();
  // Begins the next step with those in the state, which may have changed since. `steady`: as in a motion that
  // lasts, after a step of the same length, with the present loads.
  void begin_with_shown(bool steady);
  // The options, with automatic values replaced by the derived ones.
  double margin() const;
  double recovery_speed() const;
  double restitution_speed() const;

 private:
  // An attempt at a step: the number of parts; whether it is damped; whether it is the last attempt. A damped
  // attempt is of first order and may lose but never gain energy.
  struct Attempt {
    unsigned parts;
    bool damped, recovers, is_last, is_first = false;
  };
  // The end of an attempt or of a part of it. sound: within all tolerances; missed: not so, but the step
  // moved on. The last two leave the state as it was: velocities are not finite, or the part created energy
  // and another attempt follows. woken: islands asleep are awake now, and the attempt is made again.
  enum class Outcome : unsigned char { sound, missed, not_finite, unbalanced, woken };
  // A problem and its solution.
  struct Solve {
    std::shared_ptr<const Problem> problem;
    std::vector<double> x;
  };
  void make_step(Report& report);
  // The same for a step that would change nothing but the time, as the last one did; false if it could.
  bool repeat_step(Report& report);
  void note_whether_changed(const Report& report);
  void finish_report(Report& report);
  Outcome try_step(const Attempt& attempt, StepClock& clock, Report& report);
  // The stages of a part of length h (s), step/step.cpp.
  Outcome advance(double h, const Attempt& attempt, StepClock& clock, StepSums& sums, Report& report);
  bool wakes(bool all);
  void let_sleep(const StepSetting& step, std::size_t found);
  void keep_results(double joint_error, const Subset& visited);
  void note_touching(bool advanced);
  void begin_step();
  void put_back();
  const Solve& whole() const;
  void forget_whole();

  State first_state() const;

  std::shared_ptr<const Model> model_;
  std::shared_ptr<const Tree> tree_;
  SimulationOptions options_;
  State state_;
  // A copy takes these over with the state: results of the last step, with which the next one compares.
  struct Last {
    State before;                   // at the start of the step
    double begun = 0;               // s, of its last substep: the instant of its forces
    double between = 1;             // s, from the middle of the step before to that of this one
    std::vector<Transform> stood;   // poses of all bodies there
    double joint_error = infinity;  // m, at that instant
    double to_reserve = 0;          // s, that work after the solve took: the next step reserves it
    std::vector<Contact> contacts;
    std::vector<GeomPair> touching, touched;  // with a force in the last step, and in the one before
    std::vector<JointReaction> reactions;
    Solve solve;
    // Islands that the next step leaves out. The contacts above are those of the others, `found` of them in
    // the order of pairs.
    Sleepers asleep;
    std::size_t found = 0;
    bool beside_sleepers = false;  // the problem is that of the islands awake
    // The step changed nothing but the time, and `report` is that of all steps that repeat it.
    bool changed_nothing = false;
    Report report;
    bool has_energies = false;  // the report
  } last_;
  std::unique_ptr<StepScratch> scratch_;
  // All islands, made on demand after a step beside islands asleep.
  struct Whole {
    std::mutex reading;
    bool has_contacts = false;
    std::vector<Contact> contacts;
    Solve solve;
  };
  std::unique_ptr<Whole> whole_ = std::make_unique<Whole>();
  std::atomic<bool> stepping_{false};
};

}  // namespace amontons
