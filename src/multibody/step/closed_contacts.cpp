#include "multibody/step/closed_contacts.hpp"

#include <algorithm>

#include "amontons/base/ablation.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/positions.hpp"

namespace amontons {

Assembly assembly_of_step(const Model& model, const std::vector<Contact>& contacts, std::size_t joint_rows,
                          double h, double recovery, bool keeps_closed, double tolerance) {
  const double fall = h * norm(model.description().gravity), error = allowed_error(model.length());
  const bool overlaps = std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    return !off("deep") && c.gap < -2 * error && !(c.material.compliance > 0);
  });
  const bool few = off("slack") || 3 * contacts.size() + joint_rows <= step::few_rows;
  return {
      .h = h,
      .recovery_speed = recovery,
      .closing = keeps_closed && !overlaps && !off("closing") ? step::closing * fall : 0,
      .most_closed = error,
      .slack =
          few ? 0 : std::min(step::steps_of_slack * tolerance * fall * h, step::most_slack * model.length())};
}

}  // namespace amontons
