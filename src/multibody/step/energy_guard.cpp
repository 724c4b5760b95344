// docs/algorithm.md (29): impulses x act along the mean of the velocities before and after them: their work
// is x' (u- + u+) / 2 with u = D v, and for any x it is the change of the kinetic energy that is theirs. Of a
// contact u has the velocity of its surfaces, and bodies that are driven move in it: what they do to others
// is no energy from nothing.
#include "multibody/step/energy_guard.hpp"

#include <algorithm>

#include "multibody/contacts/contact_law.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/step/assemble.hpp"

namespace amontons {

namespace {

// Of the kinetic energy, of that which gravity gives in a step to what is free, and of that of the change of
// the velocities: what the residual of a solve and the second order of a step may add. The last is what
// motors and springs do where they turn a robot round: joints take out velocities across their way, of second
// order, against which the same loads have worked. What recovery by velocities gives is bounded by its speed.
constexpr double of_motion = 1e-3, of_gravity = 0.1, of_change = 1e-2;
// Of the energy that all loads and springs would give to what is free and at rest: the rounding of what holds
// against them.
constexpr double of_loads = 1e-6;

double contact_work(const EnergyInput& in, const BodyVelocities& after) {
  const auto& contacts = std::get<ContactSystem>(in.problem.A).contacts;
  double work = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    if (c.material.compliance > 0) continue;  // a spring, which gives back what it has
    const double* x = &in.solution.x[in.problem.graph.first_row[i]];
    const ContactImpulse impulse = to_world(c, x);
    const ContactImpulse before = relative_motion(c, in.start), then = relative_motion(c, after);
    work += 0.5 * dot(impulse.linear, before.linear + then.linear) +
            0.5 * dot(impulse.angular, before.angular + then.angular);
  }
  return work;
}

// What closed contacts may do as they are kept closed, at `closing`: next to nothing beside gravity. Where
// joints press bodies together by more, stresses of any size, that is no reason to let them move.
double closing_work(const EnergyInput& in) {
  const std::size_t contacts = std::get<ContactSystem>(in.problem.A).contacts.size();
  double impulses = 0;
  for (std::size_t i = 0; i < contacts; ++i) impulses += in.solution.x[in.problem.graph.first_row[i]];
  return in.closing * impulses;
}

double joint_work(const EnergyInput& in, const BodyVelocities& after) {
  const std::size_t first = in.problem.rows() - in.rows.tags.size();
  double work = 0;
  for (std::size_t i = 0; i < in.rows.tags.size(); ++i) {
    const Restraint r = in.rows.restraint[i];
    const bool passive = r == Restraint::equality || r == Restraint::inequality;
    if (!passive && in.rows.tags[i].kind != RowKind::friction) continue;
    const JacobianRow& row = in.rows.jacobian[i];
    // A row over many bodies is several over auxiliary ones, whose work is counted by none.
    if (std::max(row.body_a, row.body_b) >= static_cast<Index>(after.size())) continue;
    work += 0.5 * in.solution.x[first + i] * (row_velocity(row, in.start) + row_velocity(row, after));
  }
  return work;
}

}  // namespace

EnergyBalance energy_balance(const EnergyInput& in, BodyVelocities& after) {
  // Impulses act on the spin of the start, of which the mean over the step is short by the lag.
  after = in.after;
  double inertial = 0, gravity = 0, recovered = 0, changed = 0, driven = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (!in.model.is_dynamic(static_cast<Index>(i))) continue;
    after[i].angular += in.spins[i].lag;
    const double half_mass = 0.5 * in.model.description().bodies[i].mass;
    const Vec3 spun = after[i].angular - in.start[i].angular;
    changed += half_mass * norm_squared(after[i].linear - in.start[i].linear) +
               0.5 * dot(spun, in.frames[i].inertia * spun);
    gravity += half_mass * norm_squared(in.dt * in.model.description().gravity);
    const Vec3 turned = in.free[i].angular - in.start[i].angular;
    driven += half_mass * norm_squared(in.free[i].linear - in.start[i].linear) +
              0.5 * dot(turned, in.frames[i].inertia * turned);
    recovered += half_mass * in.recovery * in.recovery;
    // What the inertia that stiffening adds takes up is no energy of the body.
    if (!in.mobility[i].stiffened) continue;
    const Vec3 change = in.after[i].angular - in.free[i].angular;
    const Vec3 felt = inverse(in.mobility[i].inverse_inertia) * change;
    inertial += 0.5 * dot(in.start[i].angular + after[i].angular, in.frames[i].inertia * change - felt);
  }
  const double kinetic =
      kinetic_energy(in.model, in.frames, in.start) + kinetic_energy(in.model, in.frames, after);
  return {contact_work(in, after) + joint_work(in, after) + inertial,
          of_motion * kinetic + of_gravity * gravity + of_change * changed + of_loads * driven + recovered +
              std::min(closing_work(in), of_gravity * gravity)};
}

// Along s x the work is a s + c s^2, which its values at 1 and 1/2 tell; the largest s in [0, 1] with work 0
// is -a / c where a < 0, else 0: bodies fly on freely for a step, and what they miss of joints and contacts
// is an error of position, which the following steps take back.
EnergyBalance take_back(const EnergyInput& in, EnergyBalance balance, Solution& solution,
                        BodyVelocities& after, BodyVelocities& scratch) {
  const std::vector<double> x = solution.x;
  const auto scale = [&](double s) {
    for (std::size_t i = 0; i < x.size(); ++i) solution.x[i] = s * x[i];
    project(in.problem.K, solution.x, solution.x);  // intervals without zero
    after = in.free;
    apply_impulses(in.problem, solution.x, after);
    return energy_balance(in, scratch);
  };
  const double whole = balance.work, half = scale(0.5).work;
  const double a = 4 * half - whole, c = 2 * whole - 4 * half;
  if (a < 0 && c > 0) {
    balance = scale(std::min(1.0, -a / c));
    if (balance.work <= balance.allowed) return balance;
  }
  return scale(0);
}

}  // namespace amontons
