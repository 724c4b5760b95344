// Coordinates from poses: the q that makes T(q) fit the present relative pose best, displacements weighed
// against angles with Model::length(). Gauss-Newton from the coordinates of the last step keeps count of
// turns.
#include "amontons/multibody/joints/coordinates.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "multibody/joints/joint_context.hpp"

namespace amontons {
namespace {

constexpr double pi = std::numbers::pi;

double squared_error(const ChainKinematics& chain, double length) {
  const double d = norm_squared(chain.error.linear) / (length * length);
  return chain.spherical ? d : d + norm_squared(chain.error.angular);
}

struct Fit {
  double squared_error;
  bool converged;
};

// Improves q in place. The error is the twist that leads from T(q) to the pose, so that its least-squares
// solution over the screws is dq_i = <dual_i, error>.
Fit fit(const Joint& joint, const Transform& relative, double length, std::span<double> q) {
  constexpr int most_steps = 25;
  constexpr double largest_turn = 1;       // rad in one step: T(q) is far from linear beyond
  constexpr double smallest_step = 1e-14;  // radians or lengths
  constexpr double small_step = 1e-6;
  ChainKinematics chain = chain_kinematics(joint, relative, q);
  double largest = infinity;
  for (int step = 0; step < most_steps && largest > smallest_step; ++step) {
    const auto duals = dual_wrenches(chain, length);
    Screw error = chain.error;
    if (chain.spherical) error.angular = {};
    largest = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      double dq = dot(duals[i], error);
      if (joint.dofs[i].kind == Dof::Kind::hinge) dq = std::clamp(dq, -largest_turn, largest_turn);
      const double unit = joint.dofs[i].kind == Dof::Kind::hinge ? 1 : length;
      largest = std::max(largest, std::abs(dq) / (unit + std::abs(q[i])));
      q[i] += dq;
    }
    chain = chain_kinematics(joint, relative, q);
  }
  return {squared_error(chain, length), largest <= small_step};
}

// The angle of a rotation about a unit axis (swing-twist decomposition) next to `near`. It minimises the
// angle of the rotation that is left.
double hinge_angle(const Quat& rotation, const Vec3& axis, double near) {
  const double angle = 2 * std::atan2(dot(rotation.vector(), axis), rotation.w);
  return near + std::remainder(angle - near, 2 * pi);
}

// Where the first angle of a hinge lies outside its limits but a full turn away inside.
double turned_into_limits(const Dof& dof, double q) {
  if (q >= dof.lower && q <= dof.upper) return q;
  for (const double bound : {dof.lower, dof.upper}) {
    if (!std::isfinite(bound)) continue;
    const double turns =
        bound == dof.lower ? std::ceil((bound - q) / (2 * pi)) : std::floor((bound - q) / (2 * pi));
    const double turned = q + 2 * pi * turns;
    if (turned >= dof.lower && turned <= dof.upper) return turned;
  }
  return q;
}

// Starts of all hinges at -120, 0 and 120 degrees, in lexicographic order; the best fit wins.
void search(const Joint& joint, const Transform& relative, double length, std::span<double> q, double error) {
  constexpr double good = 1e-12;
  std::array<double, 6> trial;
  std::size_t starts = 1;
  for (const Dof& dof : joint.dofs)
    if (dof.kind == Dof::Kind::hinge) starts *= 3;
  for (std::size_t start = 0; start < starts && error > good; ++start) {
    std::size_t digits = start;
    for (std::size_t i = 0; i < q.size(); ++i) {
      trial[i] = 0;
      if (joint.dofs[i].kind != Dof::Kind::hinge) continue;
      trial[i] = (static_cast<double>(digits % 3) - 1) * (2 * pi / 3);
      digits /= 3;
    }
    const double found = fit(joint, relative, length, std::span(trial).first(q.size())).squared_error;
    // A start must be clearly better: otherwise the coordinates would jump between equal fits.
    if (!(found < 0.25 * error)) continue;
    error = found;
    std::copy_n(trial.begin(), q.size(), q.begin());
  }
}

void update_joint(const Joint& joint, const Transform& relative, double length, std::span<double> q) {
  constexpr double good = 1e-6;  // squared error of a first fit
  const bool first = std::all_of(q.begin(), q.end(), [](double v) { return v == 0; });
  std::size_t hinges = 0, hinge = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (joint.dofs[i].kind != Dof::Kind::hinge) continue;
    ++hinges;
    hinge = i;
  }
  if (hinges == 1 && !joint.spherical) {
    q[hinge] = hinge_angle(relative.rotation, joint.dofs[hinge].axis, q[hinge]);
    if (first) q[hinge] = turned_into_limits(joint.dofs[hinge], q[hinge]);
  }
  const Fit found = fit(joint, relative, length, q);
  // Later on the nearest fit is the right one, however badly the joint is violated, unless there is none.
  if ((hinges > 1 || (hinges == 1 && joint.spherical)) &&
      (first ? found.squared_error > good : !found.converged))
    search(joint, relative, length, q, found.squared_error);
}

}  // namespace

void update_coordinates(const Model& model, const std::vector<BodyFrame>& bodies, State& state) {
  state.coordinates.resize(model.dofs());
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (joint.dofs.empty()) continue;
    const std::span<double> q = std::span(state.coordinates).subspan(model.first_dof(j), joint.dofs.size());
    update_joint(joint, joint_pose(joint, bodies).relative, model.length(), q);
  }
}

State initial_state(const Model& model) {
  State s;
  for (const Body& body : model.description().bodies) {
    s.positions.push_back(body.pose.position);
    s.orientations.push_back(normalised(body.pose.rotation));
    s.linear_velocities.push_back(body.linear_velocity);
    s.angular_velocities.push_back(body.angular_velocity);
  }
  s.forces.resize(model.bodies());
  s.torques.resize(model.bodies());
  s.coordinates.resize(model.dofs());
  s.dof_impulses.resize(model.dofs());
  s.joint_wrenches.resize(model.joints());
  s.ball_impulses.resize(model.joints());
  s.coupling_impulses.resize(model.description().couplings.size());
  for (const Joint& joint : model.description().joints)
    for (const Dof& dof : joint.dofs) s.targets.push_back(dof.motor.target);
  std::vector<BodyFrame> frames;
  std::vector<BodyMobility> mobility;
  std::vector<BodyVelocity> velocities;
  place_bodies(model, s, frames, mobility, velocities);
  update_coordinates(model, frames, s);
  return s;
}

}  // namespace amontons
