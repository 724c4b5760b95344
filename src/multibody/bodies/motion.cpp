#include "multibody/bodies/motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "amontons/base/elementary.hpp"

namespace amontons {

namespace {

// docs/algorithm.md (4): one implicit midpoint step of Euler's equations, I (W1 - W0) = s (I Wm) x Wm with Wm
// = (W0 + W1) / 2. For any s it keeps |I W| and <W, I W>. The Cayley transform of s Wm, a rotation by 2
// atan(s |Wm| / 2), keeps the momentum in space (Simo and Wong, IJNME 1991; Krysl and Endres, IJNME 2005). s
// = 2 tan(h |Wm| / 2) / |Wm| makes that rotation exp(h Wm), which is exact for constant W.
//
// s as a function of W. If the body turns by less than 0.06 rad in the step, as nearly always, tan(x) / x
// with x = h |W| / 2 comes from its series in t = x^2. The next term, 0.009 t^5, is below rounding there. The
// bound 1.2 on x keeps the tangent away from its pole if an iterate is too large; the solution itself is far
// below it (largest_turn).
double cayley_time(const Vec3& W, double h) {
  const double t = 0.25 * h * h * norm_squared(W);
  if (t < 1e-3) return h * (1 + t * (1.0 / 3 + t * (2.0 / 15 + t * (17.0 / 315 + t * (62.0 / 2835)))));
  const double x = std::sqrt(t);
  return h * elementary::tan(std::min(x, 1.2)) / x;
}

// Newton's method for F(W) = 2 I (W - W0) - s (I W) x W = 0 in W = Wm, with s constant in the derivative:
// d((I W) x W) = ([I W]x - [W]x I) dW. The remaining error is of second order in the step, except for a share
// (h |W|)^3 / 6, as s is not constant. It is below rounding after a small step of a small turn.
Vec3 midpoint(const Mat3& I, const Vec3& W0, double h) {
  const double size = norm_squared(W0);
  const double enough = h * h * size < 1e-3 ? 1e-22 : 1e-32;
  Vec3 W = W0;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double s = cayley_time(W, h);
    const Vec3 L = I * W;
    const Vec3 F = 2 * (I * (W - W0)) - s * cross(L, W);
    const Mat3 J = 2.0 * I + -s * (skew(L) + -1.0 * (skew(W) * I));
    const Vec3 step = inverse(J) * F;
    W -= step;
    if (norm_squared(step) <= enough * size) break;
  }
  return W;
}

// Rotations above this limit (rad) are divided into parts: the equations above have one root near W0 only for
// small turns. A body that would need more than most_parts, 16 turns in a step, has no meaningful spin; the
// bound limits the work.
constexpr double largest_turn = 0.5;
constexpr double most_parts = 200;

// The step replaces omega by the mean spin, which turns the body as the torque-free motion does. The
// difference, the lag, is added again when the body has turned (end_spin). Impulses act on the mean: a joint
// constrains the motion over the step, not the one at its start.

GyroscopicSpin gyroscopic_spin(const Body& body, const Quat& orientation, const Vec3& omega, double h) {
  if (omega == Vec3{}) return {omega, {}};
  const Vec3 spin = rotate(conjugate(orientation), omega);
  const Vec3 mean_spin = torque_free_mean(body.inertia, spin, h);
  if (mean_spin == spin) return {omega, {}};
  const Vec3 mean = rotate(orientation, mean_spin);
  return {mean, omega - mean};
}

// A turn of a body by an angle (rad).
struct Turn {
  Quat before, after;
  double angle;
};

// The angular velocity at the end of a step that turned a dynamic body from `before` to `after` by `angle`,
// with the velocity `omega` of the solve. The angular momentum that the impulses left is I (omega + lag) in
// the axes of the start. It is constant in space, and with the turned inertia it gives the velocity. The
// energy is constant if the turn is that of the torque-free motion. Impulses change the turn, for example
// those of a hinge about an axis that is not principal; the energy then changes by a term of second order in
// the angle. For a large angle this does not hold: an energy gain is removed, and momentum with it.
Vec3 end_spin(const Mat3& inverse_inertia, const Mat3& inertia, const GyroscopicSpin& spin, const Vec3& omega,
              const Turn& turn) {
  const auto& [before, after, angle] = turn;
  const Vec3 momentum = inertia * (omega + spin.lag);
  const bool turned = !(after == before);
  // If the inertia does not turn with the body (spheres, rest), the bits are kept.
  if (!turned || !(norm(cross(momentum, omega)) > 1e-15 * norm(momentum) * norm(omega)))
    return omega + spin.lag;
  const Vec3 end = rotate(after, inverse_inertia * rotate(conjugate(after), momentum));
  const double had = dot(omega + spin.lag, momentum), has = dot(end, momentum);
  return angle > resolved_turn && has > had ? std::sqrt(had / has) * end : end;
}

}  // namespace

// A torque-free body turns over h by some rotation exp(h mean). The parts of the turn are multiplied, and the
// logarithm of the product, with its branch, is h mean.
Vec3 torque_free_mean(const Mat3& I, const Vec3& omega, double h) {
  const Vec3 L = I * omega;
  const double spin = norm(omega), momentum = norm(L);
  // The spin axis is principal and constant: nothing to solve (and spheres stay exact).
  if (norm(cross(L, omega)) <= 1e-14 * momentum * spin) return omega;
  const double parts = std::ceil(h * spin / largest_turn);
  if (parts <= 1) return midpoint(I, omega, h);
  // Body axes: W1 = 2 Wm - W0 after each part; the turns compose from the right.
  const double part = h / std::min(parts, most_parts);
  Quat turn;
  Vec3 W = omega;
  for (double k = 0; k < std::min(parts, most_parts); ++k) {
    const Vec3 mean = midpoint(I, W, part);
    turn = turn * exponential(part * mean);
    W = 2 * mean - W;
  }
  // The logarithm omits whole turns: take the branch next to h omega.
  const Vec3 r = logarithm(normalised(turn));
  const double angle = norm(r);
  if (angle == 0) return omega;
  const Vec3 axis = r / angle;
  const double turns = std::round((h * dot(omega, axis) - angle) / (2 * std::numbers::pi));
  return ((angle + 2 * std::numbers::pi * turns) / h) * axis;
}

// Exact for constant velocities: the centre of mass moves straight while the body turns about it, which is
// not a screw motion.
Transform moved(const BodyFrame& body, const BodyVelocity& v, double h) {
  const Quat turn = exponential(h * v.angular);
  const Vec3 centre = body.centre + h * v.linear;
  return {centre + rotate(turn, body.pose.position - body.centre), turn * body.pose.rotation};
}

// docs/algorithm.md (2). Linear: v + k (g + f / m) over the kick k. Angular: I omega' = torque - omega x I
// omega, where the mean of the torque-free rotation replaces omega and so includes the gyroscopic term.
void make_free_velocities(const FreeMotion& in, BodyVelocities& free, std::vector<GyroscopicSpin>& spins) {
  free.resize(in.start.size());
  spins.resize(free.size());
  const auto set_free = [&](std::size_t i) {
    const auto& [model, h, kick, frames, mobility, start, loads, damped, in_tree, _1, _2] = in;
    free[i] = start[i];
    spins[i] = {start[i].angular, {}};
    if (!model.is_dynamic(static_cast<Index>(i)) || (!in_tree.empty() && in_tree[i] >= 0)) return;
    const auto& [inverse_mass, inverse_inertia, stiffened] = mobility[i];
    spins[i] = gyroscopic_spin(model.description().bodies[i], frames[i].pose.rotation, start[i].angular, h);
    const Vec3& mean = spins[i].mean;
    const Vec3 g = model.description().bodies[i].gravity_scale * model.description().gravity;
    free[i].linear += kick * g + inverse_mass * loads[i].force;
    free[i].angular = mean + inverse_inertia * loads[i].torque;
    // For changes of its spin a stiffened body has the inertia I + h^2 K. Damped (implicit Euler): (I + h^2
    // K) w = I w_mean + torque.
    if (stiffened && damped) free[i].angular += inverse_inertia * (frames[i].inertia * mean) - mean;
  };
  in.visited.each(free.size(), set_free, in.threads);
}

// docs/algorithm.md (3). Symplectic Euler: positions move with the velocities at the end of the step,
// rotations by the exponential of theirs. The exponential keeps quaternions of unit length and is exact for
// constant spin. normalised() only removes the rounding.
//
// Velocities in the state are ahead of v by the same acceleration, of the momenta: impulses change these, and
// the turn of an inertia does not. The spin is then exact for a free body.
// A body that the step has stopped rests, and keeps the bits of its pose.
void integrate(const Model& model, const BodyFrames& frames, const std::vector<GyroscopicSpin>& spins,
               const Drift& drift, State& state, std::span<const Index> in_tree) {
  const auto move = [&](std::size_t i) {
    const auto& [start, v, h, ahead, _1, _2] = drift;
    const Body& body = model.description().bodies[i];
    if (body.motion == Motion::still || (!in_tree.empty() && in_tree[i] >= 0)) return;
    const bool rests = v[i].linear == Vec3{} && v[i].angular == Vec3{} && spins[i].lag == Vec3{};
    if (rests) {
      state.linear_velocities[i] = state.angular_velocities[i] = {};
      state.middle_velocities[i] = {};
      return;
    }
    const Quat before = state.orientations[i];
    Vec3 omega = v[i].angular;
    // A body without spin keeps the bits of its orientation.
    const Quat after = omega == Vec3{} ? before : normalised(exponential(h * omega) * before);
    if (model.is_dynamic(static_cast<Index>(i)))
      omega = end_spin(model.inverse_inertia(static_cast<Index>(i)), frames[i].inertia, spins[i], omega,
                       {before, after, h * norm(omega)});
    // The centre of mass moves straight; the frame follows. If nothing turns both move by the same way, which
    // is added to the place as it is: a centre that is added and subtracted would leave its rounding.
    const Vec3 way = h * v[i].linear;
    const Vec3 arm = rotate(after, body.centre_of_mass);
    const bool along = body.centre_of_mass == Vec3{} || v[i].angular == Vec3{};
    state.positions[i] = along ? state.positions[i] + way : (frames[i].centre + way) - arm;
    state.orientations[i] = after;
    MiddleVelocity& middle = state.middle_velocities[i];
    middle.linear = v[i].linear - cross(omega, arm);
    middle.angular = omega;
    Vec3 linear = v[i].linear;
    const bool stopped = linear == Vec3{} && omega == Vec3{};
    if (model.is_dynamic(static_cast<Index>(i)) && ahead[i] > 0 && !stopped) {
      linear += ahead[i] * (v[i].linear - start[i].linear);
      const Vec3 kick = ahead[i] * (frames[i].inertia * (v[i].angular + spins[i].lag - start[i].angular));
      omega += rotate(after, model.inverse_inertia(static_cast<Index>(i)) * rotate(conjugate(after), kick));
    }
    state.linear_velocities[i] = middle.left_linear = linear - cross(omega, arm);
    state.angular_velocities[i] = middle.left_angular = omega;
  };
  drift.visited.each(frames.size(), move, drift.threads);
}

}  // namespace amontons
