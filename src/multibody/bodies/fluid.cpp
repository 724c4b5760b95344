// MuJoCo's inertia model (its documentation, Computation, Fluid forces). b: the edges, d: their mean; v and
// w: velocity and spin of the box relative to the fluid along its axes i (j, k the others). Stokes' drag of a
// sphere of diameter d and the dynamic pressure on the faces are
//
//   f_i = -(3 pi d viscosity + density / 2 b_j b_k |v_i|) v_i,
//   t_i = -(pi d^3 viscosity + density / 64 b_i (b_j^4 + b_k^4) |w_i|) w_i.
#include "multibody/bodies/fluid.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace amontons {

namespace {

// The share of a speed that f = -c v takes from a free body with the inverse mass w over h. With v of
// the middle of h it is z = h c w, of second order. z / sqrt(1 + z^2) has the same order and is below one. So
// a viscous fluid stops a light body and does not reverse it.
double taken(double c, double inverse_mass, double h) {
  const double z = h * c * inverse_mass;
  return z / std::sqrt(1 + z * z);
}

}  // namespace

void add_fluid_loads(const Model& model, const StepBodies& bodies, const State& state, double kick,
                     std::vector<BodyImpulse>& loads, std::vector<unsigned char>& stopped) {
  stopped.assign(model.bodies(), 0);
  const Fluid& fluid = model.description().fluid;
  if (fluid.density == 0 && fluid.viscosity == 0) return;
  for (const FluidBox& box : model.description().fluid_boxes) {
    if (!model.is_dynamic(box.body)) continue;
    const Transform frame = bodies.frames[box.body].pose * box.frame;
    const Vec3 arm = frame.position - bodies.frames[box.body].centre;
    const Vec3& omega = state.angular_velocities[box.body];
    const Vec3 flow = state.linear_velocities[box.body] +
                      cross(omega, frame.position - bodies.frames[box.body].pose.position) - fluid.wind;
    const BodyMobility& w = bodies.mobility[box.body];
    const std::array<double, 3> b{box.size.x, box.size.y, box.size.z};
    const double mean = (b[0] + b[1] + b[2]) / 3;
    double all = 0, lost = 0;  // twice the energies of the motion and of the velocities that drag takes
    for (int i = 0; i < 3; ++i) {
      const double side = b[i], j = b[(i + 1) % 3], k = b[(i + 2) % 3];
      const Vec3 axis = rotate(frame.rotation, {i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0});
      const double speed = dot(axis, flow), spin = dot(axis, omega);
      const double c =
          3 * std::numbers::pi * mean * fluid.viscosity + 0.5 * fluid.density * j * k * std::abs(speed);
      const double turning = std::numbers::pi * mean * mean * mean * fluid.viscosity +
                             fluid.density / 64 * side * (j * j * j * j + k * k * k * k) * std::abs(spin);
      const double turned = dot(axis, w.inverse_inertia * axis);
      const double slowed = taken(c, w.inverse_mass, kick), braked = taken(turning, turned, kick);
      const double moving = speed * speed / w.inverse_mass, turn = spin * spin / turned;
      all += moving + turn;
      lost += slowed * slowed * moving + braked * braked * turn;
      const Vec3 push = -slowed * speed / w.inverse_mass * axis;
      loads[box.body].force += push;
      loads[box.body].torque += cross(arm, push) - braked * spin / turned * axis;
    }
    if (lost > 0.25 * all) stopped[box.body] = 1;
  }
}

}  // namespace amontons
