// Islands asleep: they rested in the last step, and everything that they depend on has the bits of that step.
#pragma once
#include "amontons/multibody/contacts/sleepers.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// A step that was solved, for the islands that may fall asleep after it.
struct StepAtRest {
  const StepSetting& step;
  const State &before, &after;
  const StepProblem& posed;
  const StepIslands& islands;
  const Problem& problem;
  const std::vector<double>& x;
  std::size_t found;  // contacts that the first search found; later ones follow them
};
// Puts islands to sleep that the next step would find as this one did, and takes their contacts from
// `contacts`. Returns how many of the contacts found at first remain.
std::size_t fall_asleep(const StepAtRest& in, std::vector<Contact>& contacts, Sleepers& asleep);

// Bodies with other bits in the state than at the beginning of the last step: a pose, a velocity, a load.
void find_changed(const State& before, const State& now, std::vector<Index>& changed);
// Wakes the islands of these bodies, and those of which something else changed since then: a control, an
// impulse in the state, or a driven body on which they lie. Appends to `touching` the pairs of those that
// woke.
void wake_changed(const Tree& tree, const State& before, const State& now, std::span<const Index> changed,
                  Sleepers& asleep, std::vector<GeomPair>& touching);
// Wakes the islands of these bodies.
void wake(const Model& model, std::span<const Index> bodies, Sleepers& asleep,
          std::vector<GeomPair>& touching);
void wake_all(Sleepers& asleep, std::vector<GeomPair>& touching);

// The velocities of bodies asleep after any step.
void stop_asleep(const Sleepers& asleep, const Subset& visited, BodyVelocities& v);
// Inserts their impulses into those of the contacts awake that the state carries over. Both ascend by pairs.
void carry_asleep(const Sleepers& asleep, std::vector<CarriedContact>& carried);
// Appends the impulses along their joints, which have no rows.
void know_asleep(const Sleepers& asleep, JointRows& rows);
// Adds the impulses on their bodies of trees to w, six numbers per body. The rates of all trees follow
// together from them.
void push_asleep(const Sleepers& asleep, std::span<double> w);
// All contacts in the order of one search: `found` of the awake ones are ordered by pairs, later ones follow.
void join_contacts(const std::vector<Contact>& awake, std::size_t found, const Sleepers& asleep,
                   std::vector<Contact>& all);

}  // namespace amontons
