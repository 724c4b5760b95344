#include "multibody/bodies/motion.hpp"

#include "multibody/bodies/gyroscopic.hpp"

namespace amontons {

namespace {

GyroscopicSpin gyroscopic_spin(const Body& body, const Quat& orientation, const Vec3& omega, double h) {
  const Vec3 spin = rotate(conjugate(orientation), omega);
  const Vec3 mean_spin = torque_free_mean(body.inertia, spin, h);
  if (mean_spin == spin) return {omega, {}};
  const Vec3 mean = rotate(orientation, mean_spin);
  return {mean, omega - mean};
}

// The angular velocity at the end of a step that turned a dynamic body from `before` to `after` with the
// velocity `omega` of the solve. The angular momentum that the impulses left, I (omega + lag) in the axes of
// the start, is that in space: the velocity is what it makes of the turned inertia.
Vec3 end_spin(const Body& body, const Mat3& inertia, const GyroscopicSpin& spin, const Vec3& omega,
              const Quat& before, const Quat& after) {
  const Vec3 momentum = inertia * (omega + spin.lag);
  const bool turned = !(after == before);
  // Where the inertia does not turn with the body (spheres, rest) keep the bits.
  if (!turned || !(norm(cross(momentum, omega)) > 1e-15 * norm(momentum) * norm(omega)))
    return omega + spin.lag;
  return rotate(after, inverse(body.inertia) * rotate(conjugate(after), momentum));
}

}  // namespace

void make_free_velocities(const Model& model, const State& state, double h,
                          const std::vector<BodyFrame>& frames, const std::vector<BodyMobility>& mobility,
                          const std::vector<BodyVelocity>& start, const std::vector<BodyImpulse>& loads,
                          std::vector<BodyVelocity>& free, std::vector<GyroscopicSpin>& spins) {
  free = start;
  spins.resize(frames.size());
  const Vec3& gravity = model.description().gravity;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    spins[i] = {start[i].angular, {}};
    if (!model.is_dynamic(static_cast<Index>(i))) continue;
    const auto& [inverse_mass, inverse_inertia, stiffened] = mobility[i];
    spins[i] = gyroscopic_spin(model.description().bodies[i], frames[i].pose.rotation, start[i].angular, h);
    const Vec3& mean = spins[i].mean;
    free[i].linear += h * gravity + inverse_mass * (h * state.forces[i] + loads[i].force);
    free[i].angular = mean + inverse_inertia * (h * state.torques[i] + loads[i].torque);
    // A stiffened body: (I + h^2 K) w = I w_mean + torque.
    if (stiffened) free[i].angular += inverse_inertia * (frames[i].inertia * mean) - mean;
  }
}

void integrate(const Model& model, const std::vector<BodyFrame>& frames,
               const std::vector<GyroscopicSpin>& spins, const std::vector<BodyVelocity>& v, double h,
               State& state) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Body& body = model.description().bodies[i];
    if (body.motion == Motion::fixed) continue;
    const Quat before = state.orientations[i];
    Vec3 omega = v[i].angular;
    // A body that does not turn keeps the bits of its orientation.
    const Quat after = omega == Vec3{} ? before : normalised(exponential(h * omega) * before);
    if (model.is_dynamic(static_cast<Index>(i)))
      omega = end_spin(body, frames[i].inertia, spins[i], omega, before, after);
    // The centre of mass goes straight; the frame hangs on it.
    const Vec3 way = h * v[i].linear;
    const Vec3 arm = rotate(after, body.centre_of_mass);
    const bool centred = body.centre_of_mass == Vec3{};
    state.positions[i] = centred ? state.positions[i] + way : (frames[i].centre + way) - arm;
    state.orientations[i] = after;
    state.linear_velocities[i] = v[i].linear - cross(omega, arm);
    state.angular_velocities[i] = omega;
  }
}

}  // namespace amontons
