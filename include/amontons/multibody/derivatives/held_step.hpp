#pragma once
#include <memory>

#include "amontons/multibody/step/simulation.hpp"

namespace amontons {

// The last step of a simulation with its contacts, joints and drives held on their faces: what is open stays
// open, what sticks sticks, what slides slides. Steps from nearby states, controls and parameters then differ
// from it by its derivative, to first order (multibody/derivatives/held_faces.hpp).
class HeldStep {
 public:
  // InputError before the first step.
  explicit HeldStep(const Simulation& simulation);

  // The options of simulations that make the step held, of this model or of a variant. reach: the largest
  // change of positions (of Model::length, > 0), up to which contacts and limits that rest stay closed.
  SimulationOptions options(SimulationOptions given, double reach) const;

  // Ends the search for faces. Until then the steps with these options add the faces of problems that the
  // last one was not, as those of impacts. One step from the state before the last one finds all.
  void close();

  // See HeldFaces; of all problems of the step.
  double margin() const;
  bool determines_velocities() const;
  // Solves since close() whose rows were those of no problem of the step: they were not held.
  std::size_t others() const;
  // The largest error of the held equations in all steps so far (m/s).
  double residual() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace amontons
