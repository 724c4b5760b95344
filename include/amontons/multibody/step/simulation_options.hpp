#pragma once
#include <limits>
#include <memory>
#include <string>

#include "amontons/multibody/step/own_method.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

struct PairSearch;  // collision/broad_phase.hpp

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
  // HeldStep sets these two for the step of a derivative. The x of own_method is the solution, whatever its
  // residual, and overlaps that this speed (m/s) closes within the step are closed at once.
  bool trusts_method = false;
  double closing_at_once = 0;
  double tolerance = 1e-6;  // natural residual, relative to that of zero impulses; not tuned: a default
  std::size_t max_iterations = 0;                           // per solve; 0: the method's own limit
  double budget = std::numeric_limits<double>::infinity();  // s of wall clock per step; results then depend
                                                            // on the machine
  unsigned threads = 0;                                     // 0: one per core if the problem is large enough
  std::shared_ptr<IterateSource> iterates = {};             // as in Options; null: this library
  std::shared_ptr<PairSearch> pairs = {};  // who finds geoms that are near; null: this library
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

}  // namespace amontons
