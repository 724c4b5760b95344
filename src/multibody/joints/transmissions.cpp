// Momentum is conserved: the reference body gets the opposite wrench at the same point.
#include "multibody/joints/transmissions.hpp"

#include <cmath>
#include <numbers>

namespace amontons {

double turn_of(const Transmission& t) {
  const bool turns = t.kind == Transmission::Kind::wrench && t.force == Vec3{};
  return turns ? 2 * std::numbers::pi * norm(t.torque) : 0;
}

// All in the present poses.
Line transmission_line(const Model& model, const BodyFrames& bodies, const Transmission& t) {
  const auto pose = [&](Index body, const Transform& frame) {
    return (body < 0 ? Transform{} : bodies[body].pose) * frame;
  };
  const Transform here = pose(t.body, t.frame), there = pose(t.reference_body, t.reference);
  const Transform relative = inverse(there) * here;
  Line line;
  const auto add = [&](Index body, const Vec3& f, const Vec3& torque, const Vec3& at, double sign) {
    if (body < 0 || model.body(body).motion == Motion::still) return;
    const Vec3 m = cross(at - bodies[body].centre, f) + torque;
    line.row.add(body, {f.x, f.y, f.z, m.x, m.y, m.z}, sign);
  };
  if (t.kind == Transmission::Kind::wrench) {
    const Quat& axes = t.own_axes ? here.rotation : there.rotation;
    const Vec3 f = rotate(axes, t.force), torque = rotate(axes, t.torque);
    line.length = dot(t.torque, logarithm(relative.rotation));
    if (!t.own_axes) line.length += dot(t.force, relative.position);
    add(t.body, f, torque, here.position, 1);
    add(t.reference_body, f, torque, here.position, -1);
    return line;
  }
  // Slider and crank: a rod of length r from the crank, at v from the origin of the slider's axis a, meets
  // the axis at l with
  // v - l a| = r, l = <a, v> - sqrt(<a, v>^2 + r^2 - <v, v>). A rod that is too short points along the axis.
  const Vec3 a = rotate(there.rotation, {0, 0, 1}), v = here.position - there.position;
  const double along = dot(a, v), square = along * along + t.rod * t.rod - dot(v, v);
  const double root = square > 0 ? std::sqrt(square) : 0;
  line.length = along - root;
  // dl/dv. The turn of a adds <dl/da, w x a> = <w, a x v> dl/d<a, v>, which is the moment of the force about
  // the crank. Again both forces act at one point.
  const Vec3 f = root > 0 ? (1 - along / root) * a + v / root : a;
  add(t.body, f, {}, here.position, 1);
  add(t.reference_body, f, {}, here.position, -1);
  return line;
}

}  // namespace amontons
