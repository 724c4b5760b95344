// Coordinates from poses: the q for which T(q) fits the present relative pose best; Model::length() weighs
// displacements against angles. Gauss-Newton from the coordinates of the last step counts turns.
#include "amontons/multibody/joints/coordinates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "amontons/base/elementary.hpp"
#include "amontons/base/policy.hpp"
#include "multibody/joints/couplings.hpp"
#include "multibody/joints/course.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/tendons.hpp"

namespace amontons {
namespace {

constexpr double pi = std::numbers::pi;

// The objective of Gauss-Newton, in rad^2. A ball's rotation is free and no error.
double squared_error(const ChainKinematics& chain, double length) {
  const double d = norm_squared(chain.error.linear) / (length * length);
  return chain.spherical ? d : d + norm_squared(chain.error.angular);
}

// A fit of three digits needs no other start.
bool is_good(double squared_error) {
  return squared_error <= base::policy.three_digits * base::policy.three_digits;
}

struct Fit {
  double squared_error;  // before the last step, which is of the size of rounding if the fit converged
  bool converged;
};

// Improves q in place. The error is the twist from T(q) to the pose. Its least-squares solution over the
// screws is dq_i = <dual_i, error>.
Fit fit(const Joint& joint, const Transform& relative, double length, std::span<double> q) {
  constexpr double largest_turn = 1;  // limit of one step (rad): beyond it T(q) is far from linear
  constexpr int most_steps = 25;      // not tuned: a few suffice, and half or twice as many change no run
  // The size of a step decreases with the error of the joint and with its own size. Where the joint fits, it
  // falls by its square, and the next step is rounding. Coordinates then do not drift in a scene at rest,
  // where each step makes one more.
  const double smallest_step = std::sqrt(std::numeric_limits<double>::epsilon());
  double largest = infinity, error = infinity;
  for (int step = 0; step < most_steps && largest > smallest_step; ++step) {
    const ChainKinematics chain = chain_kinematics(joint, relative, q);
    // Duals are damped near singular poses, where a plain least-squares step is unbounded.
    const auto duals = dual_wrenches(chain, length);
    Screw to_pose = chain.error;
    if (chain.spherical) to_pose.angular = {};
    error = squared_error(chain, length);
    largest = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      double dq = dot(duals[i], to_pose);
      if (joint.dofs[i].kind == Dof::Kind::hinge) dq = std::clamp(dq, -largest_turn, largest_turn);
      const double unit = joint.dofs[i].kind == Dof::Kind::hinge ? 1 : length;
      largest = std::max(largest, std::abs(dq) / (unit + std::abs(q[i])));
      q[i] += dq;
    }
  }
  return {error, largest <= smallest_step};
}

// The angle of a rotation about a unit axis (swing-twist decomposition) next to `near`. It minimises the
// angle of the remaining rotation.
double hinge_angle(const Quat& rotation, const Vec3& axis, double near) {
  const double angle = 2 * elementary::atan2(dot(rotation.vector(), axis), rotation.w);
  return std::abs(angle - near) <= pi ? angle : near + std::remainder(angle - near, 2 * pi);
}

// Moves the first angle of a hinge by full turns if that brings it inside its limits. Poses determine angles
// up to full turns, and the range of a hinge may be [90, 270] degrees.
double turned_into_limits(const Dof& dof, double q) {
  if (q >= dof.lower && q <= dof.upper) return q;
  const double up = std::ceil((dof.lower - q) / (2 * pi)), down = std::floor((dof.upper - q) / (2 * pi));
  for (const double turned : {q + 2 * pi * up, q + 2 * pi * down})
    if (std::isfinite(turned) && turned >= dof.lower && turned <= dof.upper) return turned;
  return q;
}

// Starts of all hinges at -120, 0 and 120 degrees, in lexicographic order; the best fit is taken. No angle is
// more than 60 degrees from a start. Three hinges need 27 fits: affordable when a model is loaded or posed,
// and in a step only after the fit from the last one has failed.
void search(const Joint& joint, const Transform& relative, double length, std::span<double> q, double error) {
  std::array<double, 6> trial;
  std::size_t starts = 1;
  for (const Dof& dof : joint.dofs)
    if (dof.kind == Dof::Kind::hinge) starts *= 3;
  for (std::size_t start = 0; start < starts && !is_good(error); ++start) {
    std::size_t digits = start;
    for (std::size_t i = 0; i < q.size(); ++i) {
      trial[i] = 0;
      if (joint.dofs[i].kind != Dof::Kind::hinge) continue;
      trial[i] = (static_cast<double>(digits % 3) - 1) * (2 * pi / 3);
      digits /= 3;
    }
    const double found = fit(joint, relative, length, std::span(trial).first(q.size())).squared_error;
    if (!(found < error)) continue;
    error = found;
    std::copy_n(trial.begin(), q.size(), q.begin());
  }
}

// A joint with one hinge has its angle in closed form, at any distance from the last angle; the fit then only
// finds the slides. Without slides the angle is complete: the remaining rotation has no part about the axis,
// and the dual wrench of a hinge through the reference is a torque about it. Joints of several hinges may
// have several fits (elbow up and down) or local minima, and are searched if the first fit is poor.
void update_joint(const Joint& joint, const Transform& relative, double length, std::span<double> q) {
  // All coordinates are zero either before any fit or for a joint at zero. In the latter case the first fit
  // is good and ends at once.
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
  if (q.size() == 1 && hinges == 1 && !joint.spherical) return;
  const Fit found = fit(joint, relative, length, q);
  // Otherwise the nearest fit is the right one, however large the violation, unless there is none.
  if ((hinges > 1 || (hinges == 1 && joint.spherical)) &&
      (first ? !is_good(found.squared_error) : !found.converged))
    search(joint, relative, length, q, found.squared_error);
}

// Signed distance by which the two points are outside the range; >= 0 outside.
double excess(const Joint& rod, const Transform& relative) {
  const double distance = norm(relative.position);
  return std::max(distance - rod.upper_distance, rod.lower_distance - distance);
}

// Twice the energy of the locked directions of a compliant joint and of the rotation of a ball: 1/2 C^2 / e
// for the violation C with compliance e. Angles of locked directions count as lengths, as in their rows.
double locked_springs(const Model& model, std::size_t j, const BodyFrames& bodies, const State& state) {
  const Joint& joint = model.joint(static_cast<Index>(j));
  if (joint.compliance == 0 && joint.ball_stiffness == 0) return 0;
  const Transform relative = joint_pose(joint, bodies).relative;
  if (!is_chain(joint)) {
    const double stretch = std::max(0.0, excess(joint, relative));
    return stretch * stretch / joint.compliance;
  }
  const ChainKinematics chain = chain_kinematics(joint, relative, coordinates_of(model, state, j));
  const double turn = norm_squared(chain.error.angular), length = model.length();
  const double ball = chain.spherical ? joint.ball_stiffness * turn : 0;
  if (joint.compliance == 0) return ball;
  const double locked_turn = chain.spherical ? 0 : length * length * turn;
  return ball + (norm_squared(chain.error.linear) + locked_turn) / joint.compliance;
}

}  // namespace

// Joint by joint: coordinates relate the two bodies of a joint, so loops do not matter. The locked rows
// remove the misfit.
void update_coordinates(const Model& model, const BodyFrames& bodies, std::span<double> coordinates,
                        std::span<const unsigned char> known) {
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (joint.dofs.empty() || (!known.empty() && known[j])) continue;
    update_joint(joint, joint_pose(joint, bodies).relative, model.length(),
                 coordinates.subspan(model.first_dof(j), joint.dofs.size()));
  }
}

void update_coordinates(const Model& model, const BodyFrames& bodies, State& state,
                        std::span<const unsigned char> known) {
  state.coordinates.resize(model.dofs());
  update_coordinates(model, bodies, std::span(state.coordinates), known);
}

static bool has_static_friction(const Model& model) {
  const auto& joints = model.description().joints;
  return std::any_of(joints.begin(), joints.end(), [](const Joint& joint) {
    return std::any_of(joint.dofs.begin(), joint.dofs.end(),
                       [](const Dof& dof) { return dof.friction_static >= 0; });
  });
}

// Dofs of a joint whose bodies do not fit T(0) get the coordinates of the given poses, not zeros. Motors get
// the controls of the description. Impulses are empty before the first step.
State initial_state(const Model& model) {
  State s;
  // The given poses with quaternions normalised to rounding; a description allows 1e-6.
  for (const Body& body : model.description().bodies) {
    s.positions.push_back(body.pose.position);
    s.orientations.push_back(normalised(body.pose.rotation));
    s.linear_velocities.push_back(body.linear_velocity);
    s.angular_velocities.push_back(body.angular_velocity);
  }
  s.middle_velocities.resize(model.bodies());
  s.forces.resize(model.bodies());
  s.torques.resize(model.bodies());
  s.held_forces = s.forces;
  s.held_torques = s.torques;
  s.coordinates.resize(model.dofs());
  s.dof_impulses.resize(model.dofs());
  s.joint_wrenches.resize(model.joints());
  if (has_static_friction(model)) s.dof_slips.resize(model.dofs());
  s.joint_slips.resize(model.joints());
  s.ball_impulses.resize(model.joints());
  s.coupling_impulses.resize(model.description().couplings.size());
  s.tendon_impulses.resize(model.description().tendons.size());
  std::size_t rubs = 0;
  for (const Tendon& tendon : model.description().tendons) rubs += rubs_of(tendon);
  s.rub_impulses.resize(2 * rubs);
  s.bond_openings.resize(model.description().bonds.size());
  s.actuator_impulses.resize(model.description().actuators.size());
  for (const Actuator& actuator : model.description().actuators) {
    s.controls.push_back(actuator.control);
    s.activations.push_back(actuator.activation);
  }
  for (const Joint& joint : model.description().joints)
    for (const Dof& dof : joint.dofs)
      if (dof.motor.kind != MotorKind::none) s.controls.push_back(dof.motor.control);
  s.held_controls = s.controls;
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities velocities;
  place_bodies(model, s, frames, mobility, velocities);
  update_coordinates(model, frames, s);
  return s;
}

// The violation of rigid joints, from the error of each chain.
JointError joint_error(const Model& model, std::span<const JointContext> joints) {
  JointError worst;
  double largest = 0;
  for (const JointContext& context : joints) {
    const Joint& joint = *context.joint;
    if (context.in_tree || !is_active(model, joint) || joint.compliance > 0) continue;
    const bool chain = is_chain(joint);
    const double distance = chain ? norm(context.chain.error.linear) : excess(joint, context.pose.relative);
    const double angle = chain && !context.chain.spherical ? norm(context.chain.error.angular) : 0;
    worst.distance = std::max(worst.distance, distance);
    worst.angle = std::max(worst.angle, angle);
    const double error = std::max(distance, model.length() * angle);
    if (!(error > largest)) continue;
    largest = error;
    worst.joint = context.index;
  }
  return worst;
}

JointError joint_error(const Model& model, const BodyFrames& bodies, const State& state) {
  JointContexts joints;
  place_joints(model, bodies, state, joints);
  return joint_error(model, joints);
}

// Depth of a journal in its bearing, or of a slider in its guide; negative with room left.
static double clearance_depth(const Joint& joint, std::span<const double> q) {
  if (joint.guide_length == 0) return elementary::hypot(q[0], q[1]) - joint.clearance;
  const double tilt = 0.5 * joint.guide_length * std::abs(elementary::sin(q[2]));
  return std::abs(q[1]) + tilt - joint.clearance;
}

// Present lengths and coordinates, including those that no impulse can change.
double line_error(const Model& model, const BodyFrames& bodies, const State& state) {
  double worst = 0;
  for (std::size_t j = 0; j < model.joints(); ++j)
    if (const Joint& joint = model.joint(static_cast<Index>(j)); joint.clearance > 0)
      worst = std::max(worst, clearance_depth(joint, coordinates_of(model, state, j)));
  for (const Coupling& c : model.description().couplings) {
    if (c.compliance > 0) continue;
    const double violation = coupling_value(model, c, bodies, state).violation;
    worst = std::max(worst, coupling_scale(model, c) * (std::abs(violation) - 0.5 * c.backlash));
  }
  const auto& tendons = model.description().tendons;
  for (std::size_t k = 0; k < tendons.size(); ++k) {
    const Tendon& t = tendons[k];
    if (t.lower == -infinity && t.upper == infinity) continue;
    const Index index = static_cast<Index>(k);
    const double length = tendon_length(model, bodies, state, index);
    worst = std::max(worst, tendon_scale(model, index) * std::max(length - t.upper, t.lower - length));
  }
  return worst;
}

bool has_springs(const Model& model) {
  const auto& d = model.description();
  const auto of_dof = [](const Dof& dof) { return dof.stiffness != 0; };
  const auto of_joint = [&](const Joint& j) {
    return j.compliance != 0 || j.ball_stiffness != 0 || std::any_of(j.dofs.begin(), j.dofs.end(), of_dof);
  };
  const auto of_coupling = [](const Coupling& c) { return c.compliance != 0; };
  const auto of_tendon = [](const Tendon& t) { return t.stiffness != 0; };
  return std::any_of(d.joints.begin(), d.joints.end(), of_joint) ||
         std::any_of(d.couplings.begin(), d.couplings.end(), of_coupling) ||
         std::any_of(d.tendons.begin(), d.tendons.end(), of_tendon);
}

// Springs of dofs, balls, compliant joints, couplings and tendons: 1/2 k s^2 each, summed as twice the
// energy.
double spring_energy(const Model& model, const BodyFrames& bodies, const State& state) {
  double twice = 0;
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint)) continue;
    const std::span<const double> q = coordinates_of(model, state, j);
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double stretch = q[i] - joint.dofs[i].rest;
      twice += joint.dofs[i].stiffness * stretch * stretch;
    }
    twice += locked_springs(model, j, bodies, state);
  }
  for (const Coupling& coupling : model.description().couplings) {
    if (coupling.compliance == 0) continue;
    const double violation = coupling_value(model, coupling, bodies, state).violation;
    twice += violation * violation / coupling.compliance;
  }
  const auto& tendons = model.description().tendons;
  for (std::size_t t = 0; t < tendons.size(); ++t) {
    if (tendons[t].stiffness == 0) continue;
    const double length = tendon_length(model, bodies, state, static_cast<Index>(t));
    const double stretch = tendon_stretch(tendons[t], length);
    twice += tendons[t].stiffness * stretch * stretch;
  }
  return 0.5 * twice;
}

}  // namespace amontons
