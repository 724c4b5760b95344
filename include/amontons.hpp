#pragma once

// All headers that user programs need. Separate headers contain factorisations, single methods and the driver
// for a method of your own (docs/cpp.md).
#include "amontons/base/error.hpp"
#include "amontons/collision/pairs/collide.hpp"
#include "amontons/collision/rays/ray.hpp"
#include "amontons/collision/shapes/shapes.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/kinematics/closure.hpp"
#include "amontons/multibody/kinematics/dynamics.hpp"
#include "amontons/multibody/kinematics/motion.hpp"
#include "amontons/multibody/kinematics/rays.hpp"
#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/builder.hpp"
#include "amontons/multibody/model/model_json.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "amontons/multibody/worlds/worlds.hpp"
#include "amontons/problem/infeasibility.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/solvers.hpp"
