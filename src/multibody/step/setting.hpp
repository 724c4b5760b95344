#pragma once
#include <span>

#include "amontons/multibody/contacts/sleepers.hpp"
#include "amontons/multibody/joints/rows.hpp"
#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/model.hpp"
#include "amontons/multibody/step/simulation_options.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/step/policy.hpp"

namespace amontons {

struct StepMemory;  // step/observe.hpp

// Constant during a step of length h. The speeds and the margin are those of the options, with
// automatic values replaced.
struct StepSetting {
  const Model& model;
  const Tree& tree;
  const SimulationOptions& options;
  const Sleepers& asleep;  // islands that the step leaves out
  Visited visited;         // bodies and geoms whose data the stages make
  ContactFinder& finder;   // memory of the searches: later ones of a step go on from the first
  StepMemory& memory;
  double h;             // s, of this part of the step; options.dt is the whole step
  double last;          // s, of the one before; 0: there is none that this one continues
  bool damped = false;  // of first order: the step may lose but never gain energy
  double margin;        // m
  double recovery = 0;  // m/s, of the correction of position errors by velocities
  double displacing;    // m/s, limit of the correction of position errors by displacement
  double restitution;   // m/s, slower approaches do not bounce
  // Impulses act from the middle of the last step to the middle of this one (s).
  double kick() const { return 0.5 * (last + h); }
  // The speed that gravity adds within the step (m/s).
  double fall() const { return h * norm(model.description().gravity); }
  Reach reach(const BodyFrames& frames, const BodyVelocities& v) const {
    return {model, frames, v, h, margin, options.threads, options.pairs.get(), &asleep, visited};
  }
  JointOptions joint_options(std::span<const double> controls = {}) const {
    JointOptions all{h, recovery, model.length(), true, kick(), controls};
    all.closing = options.closing_at_once;
    all.loop_speed = recovery > 0 || options.recovery == Recovery::projection ? displacing : 0;
    return all;
  }
};

}  // namespace amontons
