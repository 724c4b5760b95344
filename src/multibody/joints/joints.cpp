#include "amontons/multibody/joints/joints.hpp"

#include "multibody/joints/ball_rows.hpp"
#include "multibody/joints/couplings.hpp"
#include "multibody/joints/distance_rows.hpp"
#include "multibody/joints/dof_rows.hpp"
#include "multibody/joints/locked_rows.hpp"

namespace amontons {

void append_joint_rows(const Model& model, const StepBodies& bodies, const State& state,
                       const JointOptions& options, JointRows& rows) {
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint)) continue;
    const JointContext context = joint_context(model, bodies.frames, state, j);
    if (!is_chain(joint)) {
      append_distance_rows(context, bodies, state, options, rows);
      continue;
    }
    append_locked_rows(context, bodies, state, options, rows);
    append_dof_rows(model, context, bodies, state, options, rows);
    if (joint.spherical) append_ball_rows(context, bodies, state, options, rows);
  }
  append_coupling_rows(model, bodies, state, options, rows);
}

}  // namespace amontons
