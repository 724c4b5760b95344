// The trees of a model over one step: poses from coordinates, M, free velocities, and the motion after the
// step. docs/algorithm.md (39), (40).
//
// The functions are called in the order in which they are declared. Each reads what those before it have put
// into TreeStep. Frames are those of place_bodies() after place_trees(), and stay until the trees move. All
// velocities of bodies are those of centres of mass, as everywhere in a step.
//
// The rates of a joint are q' of its dofs, then three angular velocities of a ball in the axes of frame_a.
// Those of a base are the velocity of its centre of mass and its angular velocity, both in world axes.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/linkage.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/trees/forest.hpp"

namespace amontons {

// A velocity field of a rigid body: of the point at the reference of its tree, and angular. Or a wrench: a
// force, and its moment about that point. World axes.
struct Flow {
  Vec3 linear, angular;
};

// A body of a tree at the start of a step.
struct TreePlace {
  Transform pose;
  Vec3 centre, reference;  // centre of mass; reference point of the tree, world
  Quat ball;               // of a spherical joint: rotation of frame_a from its place after the dofs
  Transform frame_a, frame_b, relative;  // of the joint: in the world; frame_a in frame_b
  ChainKinematics chain;
  std::array<Screw, 6> duals;
};
// Mass, first moment and inertia about the reference point, of a body or of all that it supports.
struct TreeInertia {
  double mass = 0;
  Vec3 first;
  Mat3 second;
};
// Spring, damper and inertia along a coordinate.
struct TreeDrive {
  double stiffness = 0, stretch = 0, damping = 0, inertia = 0;
};

// M over a step of length h contains forces along one coordinate that are linear in its rate. These are the
// inertia a, the damper h d and the spring h^2 k. As rows of the problem they would be bilateral with the
// compliance 1 / (a + h d + h^2 k) and leave it by elimination, with the same result.
//
// Where the trees stand at the start of a step, and their M; arrays keep their memory between steps.
struct TreeStep {
  std::vector<TreePlace> places;      // per TreeBody
  std::vector<TreeInertia> inertias;  // per TreeBody, of it alone
  std::vector<Flow> columns, duals;   // per coordinate: motion per unit rate; wrench whose power is the rate
  std::vector<Quat> turns;            // per coordinate: rotation of a hinge
  std::vector<TreeDrive> drives;      // per coordinate
  std::vector<double> before, free;   // rates at the start, and at the end without impulses
  std::vector<double> after;          // rates at the end
  double fastest = 0;                 // largest of all rates without impulses
  std::shared_ptr<ConstrainedBodies> constrained;  // M with drives, factored
  // Memory: linkages that problems may still hold; scratch.
  std::vector<std::shared_ptr<ConstrainedBodies>> pool;
  std::vector<TreeInertia> carried;
  std::vector<double> along, mean, wrenches, pushed, caused;
  std::vector<Flow> flow, supply, impulse;
  std::vector<Transform> moved;
  BodyFrames frames;
  BodyVelocities velocities;
};

// Poses of all bodies of trees from coordinates: those of dofs in the state, those of balls and bases in its
// poses. If poses differ from these by more than rounding, because the user has moved bodies, coordinates are
// fitted to them first, and the state gets the poses that follow.
void place_trees(const Model& model, const Forest& forest, State& state, TreeStep& trees);

// The contexts of joints of trees there.
void place_tree_joints(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                       const TreeStep& trees, JointContexts& joints);

// M of the trees at the placed frames, with inertia, springs and dampers of dofs over a step of length h.
void make_tree_masses(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                      double h, TreeStep& trees);
// The same M once more, over another length of step; 0: without springs and dampers.
std::shared_ptr<ConstrainedBodies> tree_masses(const Model& model, const Forest& forest, double h,
                                               TreeStep& trees);

// The rates of the joints that fit given velocities: relative ones along the dofs. Velocities in locked
// directions are left out.
void read_rates(const Forest& forest, const TreeStep& trees, const BodyFrames& frames,
                const BodyVelocities& v, std::vector<double>& rates);

// Velocities of the bodies of trees after a step of length h without impulses, nearly: for the search for
// contacts. `loads`: impulses.
void make_free_tree_velocities(const Model& model, const Forest& forest, const State& state, double h,
                               const BodyFrames& frames, const BodyVelocities& start,
                               const std::vector<BodyImpulse>& loads, TreeStep& trees, BodyVelocities& free);

// The same to rounding, if impulses w (six numbers per body of the model; empty: none) will act. M^-1 J'w is
// not included, but the motion that results with it.
void foresee_tree_velocities(const Model& model, const Forest& forest, const State& state, double h,
                             const BodyFrames& frames, const BodyVelocities& start, std::span<const double> w,
                             TreeStep& trees, BodyVelocities& free);

// The momentum of each body, as a wrench about the reference, while its coordinates move with the rates for
// h; h < 0: while they came. It belongs to the displacement of the centre of mass and to the rotation over h.
// The inertia is that in the middle, R I R' with R half of the rotation.
void make_momenta(const Model& model, const Forest& forest, const State& state, const BodyFrames& frames,
                  const BodyVelocities& start, std::span<const double> rates, double h, TreeStep& trees,
                  std::vector<Flow>& momenta);

// Moves the trees with the rates over h. Writes poses and coordinates in the state, and the velocities for
// `rates_then` there. Bodies outside of trees have moved already, with the velocities v.
void move_trees(const Model& model, const Forest& forest, const BodyFrames& frames, const BodyVelocities& v,
                double h, std::span<const double> rates, std::span<const double> rates_then, TreeStep& trees,
                State& state);

// Stores the impulses of springs, dampers and inertias that M contains, for the rates `after`.
void store_drive_impulses(const Forest& forest, double h, const TreeStep& trees, State& state);

}  // namespace amontons
