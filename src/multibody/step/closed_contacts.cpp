#include "multibody/step/closed_contacts.hpp"

#include <algorithm>

#include "multibody/step/positions.hpp"
#include "multibody/step/solve_step.hpp"

namespace amontons {

namespace {

// A solve stops at its tolerance, and what rests under a load sinks by that in every step. Contacts may close
// what comes of it at this share of the velocity that gravity gives in a step: too slow to be seen as motion.
// Deeper ones are left to the correction of positions, which knows what joints and other contacts forbid.
constexpr double kept_closed = 1e-3;

// Where rigid bodies are deep in others, nobody is asked for that: what is pressed between them has no
// velocity that would close its contacts, and positions are corrected anyway. In allowed errors:
constexpr double deep = 2;

// What tells the gaps of closed contacts apart although the tolerance does not: what it lets them move in so
// many steps, a share of the size of things at most. Few rows are solved to rounding, and tell them apart.
constexpr double steps_of_slack = 40, most_slack = 1e-5;

}  // namespace

Assembly assembly_of_step(const Model& model, const std::vector<Contact>& contacts, std::size_t joint_rows,
                          double h, double recovery, bool keeps_closed, double tolerance) {
  const double fall = h * norm(model.description().gravity), error = allowed_error(model.length());
  const bool overlaps = std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    return c.gap < -deep * error && !(c.material.compliance > 0);
  });
  const bool few = 3 * contacts.size() + joint_rows <= few_rows;
  return {.h = h,
          .recovery_speed = recovery,
          .closing = keeps_closed && !overlaps ? kept_closed * fall : 0,
          .most_closed = error,
          .slack = few ? 0 : std::min(steps_of_slack * tolerance * fall * h, most_slack * model.length())};
}

}  // namespace amontons
