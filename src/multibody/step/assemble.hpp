// The one place where bodies become a variational inequality, and impulses become velocities again.
#pragma once
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"
#include "amontons/problem/problem.hpp"

namespace amontons {

// What c depends on.
struct Assembly {
  double h, recovery_speed;
  bool impact = false;  // ask for u_n = -e u_n^- in place of the closing of gaps
  // m/s, at which contacts that overlap by no more than so much (m) are closed in any case.
  double closing = 0, most_closed = 0;
  double slack = 0;  // m: gaps and overlaps up to it are none
};

// The VI of a step: bodies, contacts, then joint rows. The lengths of the contacts' moments are set.
void assemble(const StepBodies& bodies, std::vector<Contact>& contacts, const JointRows& rows,
              const Assembly& options, Problem& problem);
Problem assemble(const StepBodies& bodies, std::vector<Contact>& contacts, const JointRows& rows,
                 const Assembly& options);

// v += M^-1 D' x
void apply_impulses(const Problem& problem, std::span<const double> x, BodyVelocities& v);

}  // namespace amontons
