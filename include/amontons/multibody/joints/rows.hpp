#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/contact_system.hpp"
#include "amontons/sets/product.hpp"

namespace amontons {

// Which quantity a row of joints is, so that its impulse finds its way back into the state.
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
  actuator
};
// Where the impulse of a row belongs.
struct RowTag {
  // A distance row of one fixed length is locked; `distance` are those of a range.
  RowKind kind;
  Index joint;  // or coupling, tendon, actuator
  // Global index of the dof; 0..2 the axis of a ball row; 0..3 which of a tendon's impulses; -1: limit of a
  // ball, helper of a row over many bodies.
  Index dof;
  double sign = 1;  // of the coordinate's direction: -1 for an upper limit
  // Of a locked or distance row or the limit of a ball: the wrench on A of a unit impulse, axes of frame_b,
  // about the origin of frame_a.
  Vec3 force{}, torque{};
  // Impulse along the coordinate per unit of x; JointOptions::length for an angle, as all rows are velocities
  // in m/s and all impulses in N s.
  double scale = 1;
};

// What a row asks of positions: nothing (springs, friction, motors that give way), C = 0, C >= 0, or to be
// left as they are, by a motor that never gives way.
enum class Restraint : unsigned char { none, equality, inequality, held };
// E and c of a row, which asks that -(D v+ + E x + c) is in the normal cone of its set at x: the compliance
// over h^2, 1/kg, and the velocity that drives, or that lets a gap close, m/s. Of a rigid row also what it
// asks of positions, and C at the start of the step, m.
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

// A body at the start of the last step, and the velocity of the solve that brought it here.
struct Past {
  Transform pose;
  Vec3 centre;
  BodyVelocity velocity;
};

// The joint rows of one step, one entry per row in each array: rows of D (bodies' centre-of-mass velocities,
// world axes), E, c, sets, warm start, and tags.
struct JointRows {
  std::vector<JacobianRow> jacobian;
  std::vector<double> compliance, c, x0, position;
  std::vector<Restraint> restraint;
  SetProduct cones;
  std::vector<RowTag> tags;
  std::vector<KnownImpulse> efforts;  // no rows; only so that store_joint_impulses can report them
  // Auxiliary bodies that rows over more than two bodies need; they follow the bodies of the model.
  std::vector<double> auxiliary_inverse_mass;
  std::vector<Past> past;  // of all bodies, where a drive has inertia; scratch of those that make rows

  void clear();
  // One row with its set and where its solve starts, N s.
  template <class S>
  void append(const S& set, const JacobianRow& row, const RowTerms& terms, double start, const RowTag& tag) {
    cones.append(set);
    jacobian.push_back(row);
    compliance.push_back(terms.compliance);
    c.push_back(terms.c);
    x0.push_back(start);
    position.push_back(terms.position);
    restraint.push_back(terms.restraint);
    tags.push_back(tag);
  }
};

// What rows depend on besides model and state.
struct JointOptions {
  double h;               // s
  double recovery_speed;  // m/s, at which velocities take back errors of position at most; 0: not at all
  double length;          // Model::length(), turns angular errors into lengths
  // Dampers of joints take up velocities; displacements that correct positions take no time and pass them.
  bool dampers = true;
};

// Stores the impulses x of the rows in the state (wrenches, dof impulses), for reports and warm start; those
// of absent rows become zero.
void store_joint_impulses(const JointRows& rows, std::span<const double> x, State& state);

}  // namespace amontons
