#include "amontons/multibody/bodies/bodies.hpp"

#include <cstring>

namespace amontons {

// The state holds the origins of the body frames, because these define the pose of a body for users. The
// equations of motion are those of centres of mass, x = p + R c and v = p' + omega x R c, where momentum and
// spin separate. M is block-diagonal, 1 / m and R I^-1 R' with the inertia I in body axes. A kinematic body
// has a velocity in contacts and joints, but zero mobility: no impulse changes it.
void place_frames(const Model& model, const State& state, BodyFrames& frames, BodyMobilities& mobility,
                  const Subset& visited, unsigned threads) {
  const bool again = frames.size() == model.bodies() && mobility.size() == model.bodies();
  frames.resize(model.bodies());
  mobility.resize(model.bodies());
  const auto place = [&](std::size_t i) {
    // Fixed bodies only need a pose: rows and loads omit them.
    const Transform pose{state.positions[i], state.orientations[i]};
    // A body that stands keeps its inertia.
    if (again && !mobility[i].stiffened && std::memcmp(&frames[i].pose, &pose, sizeof pose) == 0) return;
    const Body& body = model.description().bodies[i];
    const Mat3 R = to_matrix(pose.rotation);
    frames[i] = {pose.position + R * body.centre_of_mass, pose, {}};
    mobility[i] = {};
    if (!model.is_dynamic(static_cast<Index>(i))) return;
    frames[i].inertia = R * body.inertia * transposed(R);
    const double factor = model.mobility_factor(static_cast<Index>(i));
    mobility[i] = {factor / body.mass,
                   factor * (R * model.inverse_inertia(static_cast<Index>(i)) * transposed(R)), false};
  };
  visited.each(model.bodies(), place, threads);
}

void place_velocities(const Model& model, const State& state, const Subset& visited,
                      BodyVelocities& velocities) {
  velocities.resize(model.bodies());
  visited.each(model.bodies(), [&](std::size_t i) {
    const Body& body = model.description().bodies[i];
    const Vec3 arm = to_matrix(state.orientations[i]) * body.centre_of_mass;
    const Vec3& omega = state.angular_velocities[i];
    const bool moves = body.motion != Motion::still;
    velocities[i] =
        moves ? BodyVelocity{state.linear_velocities[i] + cross(omega, arm), omega} : BodyVelocity{};
  });
}

void place_bodies(const Model& model, const State& state, BodyFrames& frames, BodyMobilities& mobility,
                  BodyVelocities& velocities) {
  place_frames(model, state, frames, mobility, {}, 1);
  place_velocities(model, state, {}, velocities);
}

namespace {

// Calls f(i, mass) for every dynamic body that is visited.
template <class F>
void for_each_dynamic(const Model& model, const Subset& visited, F&& f) {
  visited.each(model.bodies(), [&](std::size_t i) {
    if (model.is_dynamic(static_cast<Index>(i))) f(i, model.description().bodies[i].mass);
  });
}

}  // namespace

// p = m v and L = x cross p + I omega about the world's origin. Both are constant without forces, so tests
// can measure the error of a step.
Momentum momentum(const Model& model, const State& state) {
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities velocities;
  place_bodies(model, state, frames, mobility, velocities);
  Momentum total;
  for_each_dynamic(model, {}, [&](std::size_t i, double mass) {
    const Vec3 p = mass * velocities[i].linear;
    total.linear += p;
    total.angular += cross(frames[i].centre, p) + frames[i].inertia * velocities[i].angular;
  });
  return total;
}

// The inertia is that of the frames and not the possibly stiffened one of the mobility: this is the energy of
// the motion.
double kinetic_energy(const Model& model, const BodyFrames& frames, const BodyVelocities& velocities,
                      const Subset& visited) {
  double energy = 0;
  for_each_dynamic(model, visited, [&](std::size_t i, double mass) {
    const auto& [v, omega] = velocities[i];
    energy += 0.5 * (mass * norm_squared(v) + dot(omega, frames[i].inertia * omega));
  });
  return energy;
}

double gravity_energy(const Model& model, const BodyFrames& frames) {
  double energy = 0;
  for_each_dynamic(model, {}, [&](std::size_t i, double mass) {
    const double weight = mass * model.description().bodies[i].gravity_scale;
    energy -= weight * dot(model.description().gravity, frames[i].centre);
  });
  return energy;
}

double kinetic_energy(const Model& model, const State& state) {
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities velocities;
  place_bodies(model, state, frames, mobility, velocities);
  return kinetic_energy(model, frames, velocities);
}

}  // namespace amontons
