#pragma once
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

// Mass properties of a solid for the equations of motion.
struct MassProperties {
  double mass = 0;      // kg
  Vec3 centre_of_mass;  // m
  Mat3 inertia;         // about the centre of mass, in the axes of that centre, kg m^2
};

// Mass properties of the solid of a density (kg/m^3) that fills the shape, in the frame of the shape. Throws
// InputError for a shape without volume: planes, height fields, meshes that are not closed or face inwards.
MassProperties mass_properties(const Shape& shape, double density = 1);
// The same solid, given in `frame`, in the coordinates of the parent of `frame`.
MassProperties moved(const MassProperties& solid, const Transform& frame);
// Both solids as one.
MassProperties operator+(const MassProperties& a, const MassProperties& b);

}  // namespace amontons
