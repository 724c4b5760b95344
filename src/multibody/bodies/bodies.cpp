// Bodies over one step: poses and inertias, free velocities, and the motion that follows from the velocities.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "multibody/step/step.hpp"

namespace amontons {

void make_body_frames(const Model& model, const State& state, std::vector<BodyFrame>& frames) {
  frames.resize(model.bodies());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Body& body = model.description().bodies[i];
    BodyFrame& frame = frames[i];
    frame.pose = {state.positions[i], state.orientations[i]};
    const Mat3 R = to_matrix(frame.pose.rotation);
    const Vec3 arm = R * body.centre_of_mass;
    frame.centre = frame.pose.position + arm;
    frame.omega = state.angular_velocities[i];
    frame.velocity = state.linear_velocities[i] + cross(frame.omega, arm);
    frame.free_velocity = frame.velocity, frame.free_omega = frame.omega;
    if (body.motion == Motion::fixed)
      frame.velocity = frame.omega = frame.free_velocity = frame.free_omega = {};
    if (body.motion != Motion::dynamic) {
      frame.inverse_mass = 0, frame.inertia = frame.inverse_inertia = Mat3{};
      continue;
    }
    frame.stiffened = false;
    frame.inverse_mass = 1 / body.mass;
    frame.inertia = R * body.inertia * transposed(R);
    frame.inverse_inertia = R * inverse(body.inertia) * transposed(R);
  }
}

namespace {

// One implicit midpoint step of Euler's equations, I (W1 - W0) = s (I Wm) x Wm with Wm = (W0 + W1) / 2. For
// any s it keeps |I W| and <W, I W>, and the Cayley transform of s Wm, a rotation by 2 atan(s |Wm| / 2),
// keeps the momentum in space (Simo and Wong, IJNME 1991; Krysl and Endres, IJNME 2005). s = 2 tan(h |Wm| /
// 2) / |Wm| makes that rotation exp(h Wm), which is exact when W is constant.
Vec3 midpoint(const Mat3& I, const Vec3& W0, double h) {
  Vec3 W = W0;
  const double size = norm(W0);
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double w = norm(W), half = std::min(0.5 * h * w, 1.2);
    const double s = half < 1e-6 ? h : 2 * std::tan(half) / w;
    const Vec3 L = I * W;
    const Vec3 F = 2 * (I * (W - W0)) - s * cross(L, W);
    const Mat3 J = 2.0 * I + -s * (skew(L) + -1.0 * (skew(W) * I));
    const Vec3 step = inverse(J) * F;
    W -= step;
    if (norm(step) <= 1e-16 * size) break;
  }
  return W;
}

// Rotations of more than this in a step (rad) are made of several.
constexpr double largest_turn = 0.5;

}  // namespace

Vec3 torque_free_mean(const Mat3& I, const Vec3& omega, double h) {
  const Vec3 L = I * omega;
  const double spin = norm(omega), momentum = norm(L);
  // A principal axis stays the axis: there is nothing to solve (and spheres stay exact).
  if (norm(cross(L, omega)) <= 1e-14 * momentum * spin) return omega;
  const double parts = std::ceil(h * spin / largest_turn);
  if (parts <= 1) return midpoint(I, omega, h);
  // Body axes: W1 = 2 Wm - W0 after each part; the turns compose from the right.
  const double part = h / std::min(parts, 1e6);
  Quat turn;
  Vec3 W = omega;
  for (double k = 0; k < std::min(parts, 1e6); ++k) {
    const Vec3 mean = midpoint(I, W, part);
    turn = turn * exponential(part * mean);
    W = 2 * mean - W;
  }
  // The logarithm is short of whole turns: take the branch next to h omega.
  const Vec3 r = logarithm(normalised(turn));
  const double angle = norm(r);
  if (angle == 0) return omega;
  const Vec3 axis = r / angle;
  const double turns = std::round((h * dot(omega, axis) - angle) / (2 * std::numbers::pi));
  return ((angle + 2 * std::numbers::pi * turns) / h) * axis;
}

void make_free_velocities(const Model& model, const State& state, double h,
                          const std::vector<Vec3>& impulse_force, const std::vector<Vec3>& impulse_torque,
                          std::vector<BodyFrame>& frames, std::vector<GyroscopicSpin>& spins) {
  spins.resize(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Body& body = model.description().bodies[i];
    BodyFrame& frame = frames[i];
    spins[i] = {frame.omega, {}};
    frame.free_velocity = frame.velocity, frame.free_omega = frame.omega;
    if (body.motion != Motion::dynamic) continue;
    const Quat to_body = conjugate(frame.pose.rotation);
    const Vec3 spin = rotate(to_body, frame.omega);
    const Vec3 mean_spin = torque_free_mean(body.inertia, spin, h);
    if (!(mean_spin == spin)) {
      const Vec3 mean = rotate(frame.pose.rotation, mean_spin);
      spins[i] = {mean, frame.omega - mean};
    }
    frame.free_velocity +=
        h * model.description().gravity + frame.inverse_mass * (h * state.forces[i] + impulse_force[i]);
    frame.free_omega = spins[i].mean + frame.inverse_inertia * (h * state.torques[i] + impulse_torque[i]);
    // A stiffened body: (I + h^2 K) w = I w_mean + torque.
    if (frame.stiffened)
      frame.free_omega += frame.inverse_inertia * (frame.inertia * spins[i].mean) - spins[i].mean;
  }
}

void integrate(const Model& model, const std::vector<BodyFrame>& frames,
               const std::vector<GyroscopicSpin>& spins, const std::vector<BodyVelocity>& v, double h,
               State& state) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Body& body = model.description().bodies[i];
    if (body.motion == Motion::fixed) continue;
    const Quat before = state.orientations[i];
    const Quat after = v[i].angular == Vec3{} ? before : normalised(exponential(h * v[i].angular) * before);
    Vec3 omega = v[i].angular;
    if (body.motion == Motion::dynamic) {
      // The angular momentum that the impulses left, turned into the velocity of the new orientation.
      const Vec3 momentum = frames[i].inertia * (omega + spins[i].lag);
      const Quat to_body = conjugate(after);
      const Vec3 spun = rotate(after, inverse(body.inertia) * rotate(to_body, momentum));
      // Where the inertia does not turn with the body (spheres, rest) keep the bits.
      if (!(after == before) && norm(cross(momentum, omega)) > 1e-15 * norm(momentum) * norm(omega))
        omega = spun;
      else
        omega += spins[i].lag;
    }
    const Vec3 centre = frames[i].centre + h * v[i].linear;
    const Vec3 arm = rotate(after, body.centre_of_mass);
    state.positions[i] = body.centre_of_mass == Vec3{} ? state.positions[i] + h * v[i].linear : centre - arm;
    state.orientations[i] = after;
    state.linear_velocities[i] = v[i].linear - cross(omega, arm);
    state.angular_velocities[i] = omega;
  }
}

Momentum momentum(const Model& model, const State& state) {
  std::vector<BodyFrame> frames;
  make_body_frames(model, state, frames);
  Momentum total;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!model.is_dynamic(static_cast<Index>(i))) continue;
    const Vec3 p = model.description().bodies[i].mass * frames[i].velocity;
    total.linear += p;
    total.angular += cross(frames[i].centre, p) + frames[i].inertia * frames[i].omega;
  }
  return total;
}

double kinetic_energy(const Model& model, const State& state) {
  std::vector<BodyFrame> frames;
  make_body_frames(model, state, frames);
  double energy = 0;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (model.is_dynamic(static_cast<Index>(i)))
      energy += 0.5 * (model.description().bodies[i].mass * norm_squared(frames[i].velocity) +
                       dot(frames[i].omega, frames[i].inertia * frames[i].omega));
  return energy;
}

double gravity_energy(const Model& model, const State& state, double before) {
  std::vector<BodyFrame> frames;
  make_body_frames(model, state, frames);
  double energy = 0;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (model.is_dynamic(static_cast<Index>(i)))
      energy -= model.description().bodies[i].mass *
                dot(model.description().gravity, frames[i].centre - before * frames[i].velocity);
  return energy;
}

}  // namespace amontons
