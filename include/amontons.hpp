#pragma once

// All that programs of users need. Factorisations, methods one by one and the drive of a method of your own
// are in headers apart (docs/cpp.md).
#include "amontons/base/error.hpp"
#include "amontons/collision/pairs/collide.hpp"
#include "amontons/collision/rays/ray.hpp"
#include "amontons/collision/shapes/mass.hpp"
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
