#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

// The state holds the origins of the body frames, as that is what users mean by the pose of a body; the
// equations of motion are those of centres of mass, x = p + R c and v = p' + omega x R c.
void place_bodies(const Model& model, const State& state, std::vector<BodyFrame>& frames,
                  std::vector<BodyMobility>& mobility, std::vector<BodyVelocity>& velocities) {
  frames.resize(model.bodies());
  mobility.resize(model.bodies());
  velocities.resize(model.bodies());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Body& body = model.description().bodies[i];
    const Transform pose{state.positions[i], state.orientations[i]};
    const Mat3 R = to_matrix(pose.rotation);
    const Vec3 arm = R * body.centre_of_mass;
    frames[i] = {pose.position + arm, pose, {}};
    mobility[i] = {};
    velocities[i] = {};
    if (body.motion == Motion::fixed) continue;
    const Vec3& omega = state.angular_velocities[i];
    velocities[i] = {state.linear_velocities[i] + cross(omega, arm), omega};
    if (!model.is_dynamic(static_cast<Index>(i))) continue;
    frames[i].inertia = R * body.inertia * transposed(R);
    mobility[i] = {1 / body.mass, R * inverse(body.inertia) * transposed(R), false};
  }
}

namespace {

struct Placed {
  std::vector<BodyFrame> frames;
  std::vector<BodyVelocity> velocities;
};

Placed placed(const Model& model, const State& state) {
  Placed bodies;
  std::vector<BodyMobility> mobility;
  place_bodies(model, state, bodies.frames, mobility, bodies.velocities);
  return bodies;
}

}  // namespace

Momentum momentum(const Model& model, const State& state) {
  const auto [frames, velocities] = placed(model, state);
  Momentum total;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!model.is_dynamic(static_cast<Index>(i))) continue;
    const Vec3 p = model.description().bodies[i].mass * velocities[i].linear;
    total.linear += p;
    total.angular += cross(frames[i].centre, p) + frames[i].inertia * velocities[i].angular;
  }
  return total;
}

double kinetic_energy(const Model& model, const std::vector<BodyFrame>& frames,
                      const std::vector<BodyVelocity>& velocities) {
  double energy = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!model.is_dynamic(static_cast<Index>(i))) continue;
    const auto& [v, omega] = velocities[i];
    energy +=
        0.5 * (model.description().bodies[i].mass * norm_squared(v) + dot(omega, frames[i].inertia * omega));
  }
  return energy;
}

double gravity_energy(const Model& model, const std::vector<BodyFrame>& frames,
                      const std::vector<BodyVelocity>& velocities, double before) {
  double energy = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!model.is_dynamic(static_cast<Index>(i))) continue;
    const Vec3 centre = frames[i].centre - before * velocities[i].linear;
    energy -= model.description().bodies[i].mass * dot(model.description().gravity, centre);
  }
  return energy;
}

double kinetic_energy(const Model& model, const State& state) {
  const auto [frames, velocities] = placed(model, state);
  return kinetic_energy(model, frames, velocities);
}

}  // namespace amontons
