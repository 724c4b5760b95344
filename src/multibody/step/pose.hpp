// Stage 4 of a step: bodies, joints and contacts become one variational inequality.
#pragma once
#include "multibody/step/observe.hpp"
#include "multibody/step/second_order.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// Makes the problem of a step, with the impulses of the last one as its start. Compliant contacts receive
// their impulses of the last step. Joint slips of the state become those of the last step, unless damped.
void pose(const StepSetting& step, const StepClock& clock, State& state, Observed& observed,
          StepProblem& posed);

// The demands on closed and nearly closed contacts of a step with `joint_rows` rows.
Assembly assembly_of(const StepSetting& step, const std::vector<Contact>& contacts, std::size_t joint_rows);

// Smallest change of contact velocity by turning that counts (m/s): a share of the velocity that gravity adds
// within the step. Feet that swing by less have no energy to lose there, and need not follow.
double least_turn(const StepSetting& step);

// b of the problem, for the free velocities and the turns of contacts: once they are known, and again where
// the look ahead changes them.
void write_b(const Observed& observed, StepProblem& posed);

// Contacts from `known` on were added after the problem was made. Makes all but b again with their rows,
// which come before those of joints, and with zeros for them in x0, the impulses of the present solution. No
// contact turns.
void take_in(const Solved& solved, std::size_t known, Observed& observed, StepProblem& posed);

}  // namespace amontons
