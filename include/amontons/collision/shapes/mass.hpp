#pragma once
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

// What the equations of motion need to know of a solid.
struct MassProperties {
  double mass = 0;      // kg
  Vec3 centre_of_mass;  // m
  Mat3 inertia;         // about the centre of mass, in the axes in which the centre is given, kg m^2
};

// Of the solid of a density (kg/m^3) that fills the shape, in the frame of the shape. Throws InputError for a
// shape without volume: planes, height fields, meshes that are not closed or face inwards.
MassProperties mass_properties(const Shape& shape, double density = 1);
// The same solid seen from the parent of `frame`, in which it was given so far.
MassProperties moved(const MassProperties& solid, const Transform& frame);
// Both solids as one.
MassProperties operator+(const MassProperties& a, const MassProperties& b);

}  // namespace amontons
