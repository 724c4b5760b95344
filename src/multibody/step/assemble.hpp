// Only here bodies become a variational inequality, and impulses become velocities again.
#pragma once
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"
#include "amontons/multibody/model/model.hpp"
#include "amontons/problem/problem.hpp"

namespace amontons {

// Parameters of c.
struct Assembly {
  double h, kick, recovery_speed;  // s, of the motion and of the impulses; m/s
  bool impact = false;             // require u_n = -e u_n^- instead of closing gaps
  double closing = 0;              // m/s, at which overlaps are closed
  double at_once = 0;              // m/s: overlaps that it closes within the step are closed so
  double slack = 0;                // m: smaller gaps and overlaps count as zero
  const Model* model = nullptr;    // set: contacts on trees have the compliance of joint rows
  unsigned threads = 1;            // 0: one per core; results do not depend on it
};

// A and K of the VI of a step: bodies, contacts, then joint rows. Sets the lengths of the contacts' moments.
void assemble_system(const StepBodies& bodies, std::vector<Contact>& contacts, const JointRows& rows,
                     const Assembly& options, Problem& problem);
// Its b, for the same contacts, free velocities of bodies and, unless empty, the terms of contacts that turn.
void write_b(const BodyVelocities& free, std::span<const Contact> contacts, const JointRows& rows,
             const Assembly& options, std::span<const Vec3> turns, Problem& problem);
// Both.
Problem assemble(const StepBodies& bodies, std::vector<Contact>& contacts, const JointRows& rows,
                 const Assembly& options);

// D'x, six numbers per body: impulses at the centres of mass. Valid until the next call on this thread.
std::span<double> impulses_on_bodies(const Problem& problem, std::span<const double> x);

// v += M^-1 w of the bodies visited for w = D'x, which changes. `rates` as of apply_masses().
void add_moved(const Problem& problem, std::span<double> w, const double* rates, const Subset& visited,
               BodyVelocities& v);

// v += M^-1 D' x
void apply_impulses(const Problem& problem, std::span<const double> x, BodyVelocities& v,
                    const Subset& visited = {});

}  // namespace amontons
