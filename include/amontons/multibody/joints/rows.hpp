#pragma once
#include <array>
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Kind of a row of joints; it determines where the state stores its impulse.
enum class RowKind : unsigned char {
  locked,
  passive,
  motor,
  friction,
  limit,
  ball,
  distance,
  coupling,
  tendon,
  actuator,
  rub,        // of a tendon on a pulley: `joint` is the index in State::rub_impulses
  clearance,  // of a journal in its bearing or a slider in its guide
};
// Place of the impulse of a row in the state.
struct RowTag {
  // A distance row of one fixed length is `locked`; `distance` rows are those of a range.
  RowKind kind;
  Index joint;  // or coupling, tendon, actuator
  // Global index of the dof; 0..2 the axis of a ball row; 0..3 the impulse of a tendon. -1: limit of a ball,
  // or helper of a row over many bodies.
  Index dof;
  double sign = 1;  // relative to the coordinate: -1 for an upper limit
  // For a locked or distance row or the limit of a ball: the wrench on A of a unit impulse, axes of frame_b,
  // about the origin of frame_a.
  Vec3 force{}, torque{};
  // Impulse along the coordinate per unit of x. For an angle it is JointOptions::length, because all rows are
  // velocities in m/s and all impulses in N s.
  double scale = 1;
};

// Condition of a row on positions: none (springs, friction, motors with limited effort), C = 0, C >= 0, or
// `held`, that is unchanged, by a motor with unlimited effort.
enum class Restraint : unsigned char { none, equality, inequality, held };
// E and c of a row, which requires that -(D v+ + E x + c) is in the normal cone of its set at x. E:
// compliance over h^2 (1/kg). c: driving velocity, or velocity that closes a gap (m/s). For a rigid row also
// its condition on positions, and C at the start of the step (m).
struct RowTerms {
  double compliance, c;
  Restraint restraint = Restraint::none;
  double position = 0;
};

// The impulse of an effort motor or actuator, known before the step: it acts through the free velocities.
struct KnownImpulse {
  RowTag tag;
  double impulse;  // along the coordinate, N s or N m s
};

// A body at the start of the last step, and the velocity of the solve that moved it to its present pose.
struct Past {
  Transform pose;
  Vec3 centre;
  BodyVelocity velocity;
};

// One row of a block of several.
struct BlockRow {
  JacobianRow row;
  RowTerms terms;
  double start;
  RowTag tag;
};

// The joint rows of one step, one entry per row in each array. The arrays are D (velocities of the centres of
// mass, world axes), E, c, sets, warm start, and tags.
struct JointRows {
  std::vector<JacobianRow> jacobian;
  std::vector<double> compliance, c, x0, position;
  std::vector<Restraint> restraint;
  SetProduct cones;
  std::vector<RowTag> tags;
  std::vector<KnownImpulse> efforts;  // have no rows; stored for the report of store_joint_impulses
  // Auxiliary bodies of rows over more than two bodies; they follow the bodies of the model.
  std::vector<double> auxiliary_inverse_mass;
  std::vector<Past> past;  // of all bodies, if a drive has inertia; scratch of the functions that make rows

  void clear();
  // Appends a row with its set and the start of its solve (N s).
  template <class S>
  void append(const S& set, const JacobianRow& row, const RowTerms& terms, double start, const RowTag& tag) {
    cones.append(set);
    append_row({row, terms, start, tag});
  }
  // Appends the rows of one set; all act on the same two bodies.
  template <class S>
  void append_block(const S& set, const std::array<BlockRow, S::dim>& block) {
    cones.append(set);
    for (const BlockRow& row : block) append_row(row);
  }

 private:
  void append_row(const BlockRow& block) {
    const auto& [row, terms, start, tag] = block;
    jacobian.push_back(row);
    compliance.push_back(terms.compliance);
    c.push_back(terms.c);
    x0.push_back(start);
    position.push_back(terms.position);
    restraint.push_back(terms.restraint);
    tags.push_back(tag);
  }
};

// Parameters of rows besides model and state.
struct JointOptions {
  double h;               // s
  double recovery_speed;  // m/s, limit of the correction of position errors by velocities; 0: no correction
  double length;          // Model::length(), converts angular errors to lengths
  // Dampers act on velocities. Displacements that correct positions take no time, so dampers do not act on
  // them.
  bool dampers = true;
  // s, over which impulses act: from the middle of the last step to the middle of this one.
  double kick = h;
  // Efforts follow these controls, means over that time; empty: the controls of the state.
  std::span<const double> controls = {};
  // m/s: overlaps of limits that this speed closes within the step are closed, as those of contacts are
  // (HeldStep). A joint that rests at its limit then stays there whichever side it is moved to.
  double closing = 0;
  // m/s, as recovery_speed, of rows on bodies of trees: those of joints that close loops. All errors of a
  // loop are theirs, and a pose in which its bars lie in one line magnifies them. So they are removed in each
  // step, not when they are large.
  double loop_speed = 0;
  std::span<const unsigned char> left_out = {};  // per joint: it has no rows; empty: all have
  double last() const { return 2 * kick - h; }   // s, of the step before; 0: none
};

// Stores the impulses x of the rows in the state (wrenches, dof impulses), for reports and warm start.
// Impulses without a row become zero.
void store_joint_impulses(const JointRows& rows, std::span<const double> x, State& state);
// Stores the rates of dofs whose dry friction slipped, if a dof of the model has a static friction of its
// own. Row velocities up to `least` (m/s) are errors of the solve.
void store_slips(const JointRows& rows, const Problem& problem, const Solution& solution, double least,
                 State& state);

}  // namespace amontons
