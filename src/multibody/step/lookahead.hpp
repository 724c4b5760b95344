// The variational inequality of a step: where its solve starts, the solves until nothing unforeseen is left,
// and what is kept of the solution.
#pragma once
#include <memory>
#include <vector>

#include "amontons/multibody/model/state.hpp"
#include "amontons/problem/problem.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/second_order.hpp"
#include "multibody/step/solve_step.hpp"

namespace amontons {

// The problem, and what is known of its solution.
struct StepProblem {
  JointRows rows;
  std::vector<double> x0;  // where the next solve starts; empty: from nothing
  std::shared_ptr<Problem> problem;
  ContactTurns turns;  // in b
  Solution solution;
};

// The impulses of the last step, as far as they belong to rows of this one. What a resting scene needs is a
// force: impulses are scaled by the ratio of the steps.
void warm_start(const Model& model, const State& state, double h, const BodyFrames& frames,
                const std::vector<Contact>& contacts, StepProblem& vi);

// The velocities that the impulses of the last step would lead to: of smooth motion a prediction of second
// order. Those of the start where nothing is known.
void predict(const BodyVelocities& start, const BodyVelocities& free, const StepProblem& vi,
             BodyVelocities& v);

// Turns of contacts by less than a share of what gravity adds to a velocity within the step are none: what
// stands on feet that swing has no energy to lose there, and should not be asked to follow.
double enough_of_a_turn(const Model& model, double h);

// Contacts from `known` on have come in since the problem was assembled: it is again, with their rows, which
// stand before those of joints, and zeros for them in x0, the present solution.
void take_in(const StepBodies& bodies, const Assembly& assembly, std::vector<Contact>& contacts,
             std::size_t known, StepProblem& vi);

// Solves the VI, looks where its velocities lead, and solves again as long as that brings contacts that
// nobody could foresee or if contacts turn otherwise than predicted. `after` are the velocities of the last
// solve.
void solve_with_lookahead(const Model& model, const StepBodies& bodies, const Assembly& assembly,
                          double margin, StepSolver solver, ContactFinder& finder,
                          std::vector<Contact>& contacts, StepProblem& vi, BodyVelocities& after,
                          Report& report);

// The impulses go to the table of contacts, for the user, and to the state, for the next step.
void keep_impulses(const StepProblem& vi, Law law, double h, const BodyFrames& frames,
                   const BodyVelocities& after, std::vector<Contact>& contacts, State& state);

}  // namespace amontons
