// The variational inequality of a step: the start of its solve, the solves until no unforeseen contact is
// left, and the storage of the solution.
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

// The problem, and the data of its solution.
struct StepProblem {
  JointRows rows;
  std::vector<double> x0;  // start of the next solve; empty: zero
  std::shared_ptr<Problem> problem;
  ContactTurns turns;  // contained in b
  Solution solution;
};

// The impulses of the last step, for rows that exist in this one. A resting scene needs equal forces, so
// impulses are scaled by the ratio of the steps.
void warm_start(const Model& model, const State& state, double h, const BodyFrames& frames,
                const std::vector<Contact>& contacts, StepProblem& vi);

// Velocities that the impulses of the last step would give: for smooth motion a prediction of second order.
// Without such impulses, the velocities at the start.
void predict(const BodyVelocities& start, const BodyVelocities& free, const StepProblem& vi,
             BodyVelocities& v);

// Smallest change of contact velocity by turning that counts (m/s): a share of the velocity that gravity adds
// within the step. Feet that swing by less have no energy to lose there, and need not follow.
double enough_of_a_turn(const Model& model, double h);

// Contacts from `known` on were added after the problem was assembled. Assembles it again with their rows,
// which come before those of joints, and with zeros for them in x0, the present solution.
void take_in(const StepBodies& bodies, const Assembly& assembly, std::vector<Contact>& contacts,
             std::size_t known, StepProblem& vi);

// Solves the VI and looks ahead along its velocities. Solves again while this finds contacts that the first
// search could not foresee, or contacts that turn otherwise than predicted. `after`: velocities of the last
// solve.
void solve_with_lookahead(const Model& model, const StepBodies& bodies, const Assembly& assembly,
                          double margin, StepSolver solver, ContactFinder& finder,
                          std::vector<Contact>& contacts, StepProblem& vi, BodyVelocities& after,
                          Report& report);

// Stores the impulses in the table of contacts, for the user, and in the state, for the next step.
void keep_impulses(const StepProblem& vi, Law law, double h, const BodyFrames& frames,
                   const BodyVelocities& after, std::vector<Contact>& contacts, State& state);

}  // namespace amontons
