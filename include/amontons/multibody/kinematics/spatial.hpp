// Twists, wrenches and inertias about one common point: those of all bodies add.
#pragma once
#include "amontons/base/math.hpp"

namespace amontons {

// The velocity of a body: of its point at the world's origin, and angular. Or the rates of both, the spatial
// acceleration, which is that of the flow at a place and not of a particle. World axes.
//
// About one common point twists of all bodies add, which makes every formula of the tree one line
// (Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 2). Far from the origin cancellation costs digits
// in proportion to the distance over the size of the model.
struct Twist {
  Vec3 linear, angular;
};

// The velocity of a twist at a point of the world.
constexpr Vec3 velocity_at(const Twist& twist, const Vec3& point) {
  return twist.linear + cross(twist.angular, point);
}

// A wrench is a Twist of a force and its moment about the point.
inline Twist& operator+=(Twist& a, const Twist& b) {
  a.linear += b.linear;
  a.angular += b.angular;
  return a;
}
inline Twist operator*(double s, const Twist& a) { return {s * a.linear, s * a.angular}; }
inline Twist operator-(const Twist& a, const Twist& b) {
  return {a.linear - b.linear, a.angular - b.angular};
}
inline double power(const Twist& wrench, const Twist& v) {
  return dot(wrench.linear, v.linear) + dot(wrench.angular, v.angular);
}
// The twist about the common point from its values at a point at `arm` from it.
inline Twist from_point(const Vec3& linear, const Vec3& angular, const Vec3& arm) {
  return {linear - cross(angular, arm), angular};
}
// The rate of a twist s that moves with the velocity v (Featherstone's v x s).
inline Twist carried(const Twist& v, const Twist& s) {
  return {cross(v.angular, s.linear) + cross(v.linear, s.angular), cross(v.angular, s.angular)};
}

// Inertia of one body or of several that move as one: mass, first moment m c, and inertia about the point.
struct SpatialInertia {
  double mass = 0;
  Vec3 first;
  Mat3 second;
};
inline SpatialInertia& operator+=(SpatialInertia& a, const SpatialInertia& b) {
  a.mass += b.mass;
  a.first += b.first;
  a.second = a.second + b.second;
  return a;
}
// The momentum as a wrench: p = m v_O + omega x m c, L_O = I_O omega + m c x v_O.
inline Twist momentum_of(const SpatialInertia& inertia, const Twist& v) {
  return {inertia.mass * v.linear + cross(v.angular, inertia.first),
          inertia.second * v.angular + cross(inertia.first, v.linear)};
}

}  // namespace amontons
