// Actuators apart from their rows: efforts known before a step, activations after it, and queries by users.
#include "amontons/multibody/joints/actuators.hpp"

#include <algorithm>

#include "amontons/multibody/joints/coordinates.hpp"
#include "multibody/joints/actuator_rows.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/tendons.hpp"
#include "multibody/joints/transmissions.hpp"

namespace amontons {
namespace {

// A length along one degree of freedom, and the row of its rate.
struct DofLine {
  double length;
  JacobianRow row;
};

// Calls visit(actuator, line, l') for each actuator with a known effort, of any transmission.
template <class Visit>
void for_each_known(const ActuatorCommand& command, const BodyFrames& bodies,
                    std::span<const JointContext> joints, const BodyVelocities& start, const Visit& visit) {
  const Model& model = command.model;
  const State& state = command.state;
  const auto known = [&](Index a) { return !has_row(command, a); };
  const auto visit_all = [&](const std::vector<Index>& actuators, const auto& make_line) {
    if (std::none_of(actuators.begin(), actuators.end(), known)) return;
    const auto line = make_line();
    const double rate = row_velocity(line.row, start);
    for (const Index a : actuators)
      if (known(a)) visit(a, line, rate);
  };
  for (std::size_t j = 0; j < model.joints(); ++j) {
    if (!is_active(model, model.joint(static_cast<Index>(j)))) continue;
    for (std::size_t i = model.first_dof(j); i < model.first_dof(j + 1); ++i)
      visit_all(model.actuators_of_dof(i), [&] {
        return DofLine{state.coordinates[i], joint_row(joints[j], joints[j].duals[i - model.first_dof(j)])};
      });
  }
  for (std::size_t t = 0; t < model.description().tendons.size(); ++t)
    visit_all(model.actuators_of_tendon(t),
              [&] { return tendon_line(model, bodies, joints, state, static_cast<Index>(t)); });
  for (const Index a : model.other_actuators()) {
    const Transmission& t = model.description().actuators[a].transmission;
    visit_all({a}, [&] { return transmission_line(model, bodies, t); });
  }
}

// For dofs that bound the sum of efforts: adds the known effort along each dof, including the share of fixed
// tendons. False for an actuator on neither.
bool add_effort(const Model& model, Index a, double impulse, std::vector<double>& sums) {
  const Transmission& t = model.description().actuators[a].transmission;
  if (t.kind == Transmission::Kind::dof) {
    sums[model.first_dof(t.joint) + t.dof] += impulse;
    return true;
  }
  if (t.kind != Transmission::Kind::tendon) return false;
  const Tendon& tendon = model.description().tendons[t.tendon];
  for (const TendonTerm& term : tendon.terms)
    sums[model.first_dof(term.joint) + term.dof] += term.coefficient * impulse;
  return tendon.path.empty();
}

void add_wrenches(const Model& model, const WideRow& row, double impulse, std::vector<BodyImpulse>& loads) {
  for (std::size_t i = 0; i < row.body.size(); ++i) add_wrench(model, row.body[i], row.j[i], impulse, loads);
}

void add_sums(const Model& model, std::span<const JointContext> joints, double kick,
              const std::vector<double>& sums, std::vector<BodyImpulse>& loads) {
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
      const double sum = sums[model.first_dof(j) + i];
      if (sum == 0 || !is_active(model, joint)) continue;
      const Dof& dof = joint.dofs[i];
      const JacobianRow row = joint_row(joints[j], joints[j].duals[i]);
      const double impulse = std::clamp(sum, kick * dof.lower_effort, kick * dof.upper_effort);
      add_wrenches(model, row, impulse, loads);
    }
  }
}

}  // namespace

// An effort known before the step has no row.
void add_actuator_loads(const ActuatorCommand& command, const BodyFrames& bodies,
                        std::span<const JointContext> joints, const BodyVelocities& start, double kick,
                        std::vector<BodyImpulse>& loads) {
  const Model& model = command.model;
  if (model.description().actuators.empty()) return;
  std::vector<double> sums(model.bounds_efforts() ? model.dofs() : 0);
  const auto add = [&](Index a, const auto& line, double rate) {
    const EffortLaw law = present_law(command, a, {line.length, rate});
    const double impulse = kick * known_effort(law);
    if (!sums.empty() && add_effort(model, a, impulse, sums)) return;
    add_wrenches(model, line.row, impulse, loads);
  };
  for_each_known(command, bodies, joints, start, add);
  if (!sums.empty()) add_sums(model, joints, kick, sums, loads);
}

void advance_activations(const Model& model, double h, State& state) {
  for (std::size_t a = 0; a < state.activations.size(); ++a) {
    const Actuator& actuator = model.description().actuators[a];
    if (actuator.dynamics == ActivationKind::none) continue;
    state.activations[a] = next_activation(actuator, state.controls[a], state.activations[a], h);
  }
}

namespace {

// Bodies and joints where they stand now, between two steps.
struct Placed {
  Placed(const Model& model, const State& given) : state(given) {
    place_bodies(model, state, bodies, mobility, velocities);
    update_coordinates(model, bodies, state);
    place_joints(model, bodies, state, joints);
  }
  State state;
  BodyFrames bodies;
  BodyMobilities mobility;
  BodyVelocities velocities;
  JointContexts joints;
};

}  // namespace

std::vector<LineState> actuator_lines(const Model& model, const State& given) {
  std::vector<LineState> lines;
  const Placed placed(model, given);
  const auto& [state, bodies, mobility, v, joints] = placed;
  for (const Actuator& actuator : model.description().actuators) {
    const Transmission& t = actuator.transmission;
    Line line;
    if (t.kind == Transmission::Kind::dof) {
      const JointContext& context = joints[t.joint];
      line.length = state.coordinates[model.first_dof(t.joint) + t.dof];
      line.row.add(joint_row(context, context.duals[t.dof]), 1);
    } else {
      line = t.kind == Transmission::Kind::tendon ? tendon_line(model, bodies, joints, state, t.tendon)
                                                  : transmission_line(model, bodies, t);
    }
    lines.push_back({t.gear * line.length, t.gear * row_velocity(line.row, v)});
  }
  return lines;
}

std::vector<LineState> tendon_lines(const Model& model, const State& given) {
  std::vector<LineState> lines;
  const Placed placed(model, given);
  const auto& [state, bodies, mobility, v, joints] = placed;
  for (std::size_t t = 0; t < model.description().tendons.size(); ++t) {
    const Line line = tendon_line(model, bodies, joints, state, static_cast<Index>(t));
    lines.push_back({line.length, row_velocity(line.row, v)});
  }
  return lines;
}

}  // namespace amontons
