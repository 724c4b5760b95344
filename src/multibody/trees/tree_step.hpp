// The trees of a model over one step: places, M, and rates.
//
// In a step: poses follow from coordinates (place_trees), M and its factors from poses (make_tree_masses),
// free rates from the momenta over displacements (make_free_tree_velocities, foresee_tree_velocities). All
// other stages see velocities of bodies and M^-1 as a function. At the end rates are read from the velocities
// of bodies (read_rates), so that whatever a stage did to them counts, and the trees move (move_trees).
//
// The state has no array for trees. Coordinates of dofs are in State::coordinates, turns included; the pose
// of a base and the rotation of a ball are in the poses, rates in the velocities of bodies. A step writes
// what it would read, so that a saved state continues bit for bit.
//
// Each function reads what those before it have put here. Frames are those of place_bodies() after
// place_trees(), and stay until the trees move. All velocities of bodies are those of centres of mass, as
// everywhere in a step.
//
// The rates of a joint are q' of its dofs, then three angular velocities of a ball in the axes of frame_a.
// Those of a base are the velocity of its centre of mass and its angular velocity, both in world axes.
#pragma once
#include <memory>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/kinematics/spatial.hpp"
#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/problem/linkage.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// A twist, or a wrench, about the reference point of a tree. About a point of the world it would lose digits
// in proportion to the distance of the tree from it.
using Flow = Twist;

// A body of a tree at the start of a step.
struct TreePlace {
  Transform pose;
  Vec3 centre, reference;  // centre of mass; reference point of the tree, world
  Quat ball;               // of a spherical joint: rotation of frame_a from its place after the dofs
  Transform frame_a, frame_b, relative;  // of the joint: in the world; frame_a in frame_b
  ChainKinematics chain;
  std::array<Screw, 6> duals;
};
// Spring, damper and inertia along a coordinate, and the share of implicit Euler (joints/row_terms.hpp).
struct TreeDrive {
  double stiffness = 0, stretch = 0, damping = 0, inertia = 0, euler = 1;
};

// Memory of the functions of trees, which write before they read. Arrays and linkages are kept between steps.
struct TreeMemory {
  std::vector<std::shared_ptr<ConstrainedBodies>> pool;  // linkages, which problems may still hold
  // Per TreeBody: `flow` of the last make_flows(), `moved` and `chord` of the last make_momenta().
  std::vector<Flow> flow, bias, impulse, loads, momenta, chord, chord_before;
  std::vector<Transform> moved;
  std::vector<SpatialInertia> carried;
  // Per coordinate.
  std::vector<double> along, mean, pushed, first;
  std::vector<double> wrenches;
  // After the trees have moved, all bodies.
  BodyFrames frames;
  BodyVelocities velocities;
  // The state for which the places of the last step hold; empty: unknown.
  struct {
    std::vector<Vec3> positions;
    std::vector<Quat> orientations;
    std::vector<double> coordinates;
  } placed;
};

// The step in which trees move: its model, the bodies at its start, and its length and that of the one before
// (s; 0: there is none).
struct TreeSetting {
  const Model& model;
  const Tree& tree;
  const BodyFrames& frames;
  const BodyVelocities& start;
  TreeMemory& memory;
  double h, last;
  double kick() const { return 0.5 * (last + h); }
};

// M over a step contains forces along one coordinate that are linear in its rate: of inertia, damper and
// spring. As rows of the problem they would be bilateral with the compliance of drive_terms() and leave it by
// elimination, with the same result.
//
// Where the trees stand at the start of a step, their M, and their rates.
struct TreeStep {
  std::vector<TreePlace> places;         // per TreeBody
  std::vector<SpatialInertia> inertias;  // per TreeBody, of it alone, about the reference point
  std::vector<Flow> columns, duals;  // per coordinate: motion per unit rate; wrench whose power is the rate
  std::vector<TreeDrive> drives;     // per coordinate
  // Per body of the model: inertia that stands for the stiffness of light links; empty: none needs it.
  std::vector<Mat3> stiffness;
  std::shared_ptr<ConstrainedBodies> constrained;  // M with drives, factored
  std::vector<double> before, free;                // rates at the start, and at the end without impulses
  std::vector<double> caused;                      // rates that the foreseen impulses add
  std::vector<double> after;                       // rates at the end
  double fastest = 0;                              // largest of the rates at the start
  bool slow = false;  // momenta are those of velocities, with velocity terms at the start
  // Per TreeBody: impulses of loads and the momenta before the step; of loads and velocity terms.
  std::vector<Flow> supply, slow_supply;
};

}  // namespace amontons
