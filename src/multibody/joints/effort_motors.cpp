#include "amontons/multibody/joints/effort_motors.hpp"

#include <algorithm>

#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The effort tau along dof i is the wrench tau dual_i on A and its opposite on B: D' of the dof's row, as a
// row's wrench is what its unit impulse puts on the bodies.
void add_motor_loads(const Model& model, const std::vector<BodyFrame>& bodies, const State& state, double h,
                     std::vector<BodyImpulse>& loads) {
  const auto is_effort = [](const Dof& dof) { return dof.motor.kind == MotorKind::effort; };
  const auto add = [&](Index body, const std::array<double, 6>& w) {
    if (!model.is_dynamic(body)) return;
    loads[body].force += Vec3{w[0], w[1], w[2]};
    loads[body].torque += Vec3{w[3], w[4], w[5]};
  };
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint) || std::none_of(joint.dofs.begin(), joint.dofs.end(), is_effort)) continue;
    const JointContext context = joint_context(model, bodies, state, j);
    for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
      if (!is_effort(joint.dofs[i])) continue;
      const double bound = joint.dofs[i].motor.max_effort;
      const double impulse = h * std::clamp(state.targets[model.first_dof(j) + i], -bound, bound);
      const JacobianRow row = joint_row(context, impulse * context.duals[i]);
      add(row.body_a, row.a);
      add(row.body_b, row.b);
    }
  }
}

}  // namespace amontons
