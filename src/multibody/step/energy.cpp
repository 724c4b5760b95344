// docs/algorithm.md (28). Impulses x act along the mean of the velocities before and after them. Their work
// is x' (u- + u+) / 2 with u = D v, and equals the change of kinetic energy that they cause, for any x. The u
// of a contact includes the velocity of its surfaces. Driven bodies move in u: their work on others is not
// created energy.
#include "multibody/step/energy.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/policy.hpp"
#include "amontons/problem/linkage.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/step/assemble.hpp"

namespace amontons {

namespace {

// Mean velocities of the step, and the same for bodies that impulses move (zeros for others).
struct MeanVelocities {
  BodyVelocities all, moved;
};

// Work of a row or contact that can only dissipate, in excess of the work of its impulse on dynamic bodies,
// which along_mean() has summed already. It is zero for a dissipative row between dynamic bodies.
double beyond_bodies(bool dissipates, double of_all, double of_moved) {
  return dissipates ? of_all - of_moved : -of_moved;
}

// A compliant contact is a spring: it returns its energy.
bool dissipates(const Contact& c) { return !(c.material.compliance > 0); }

// Whether a joint row can only dissipate. A row over many bodies is several rows over auxiliary bodies, whose
// work is not counted.
bool dissipates(const EnergyInput& in, std::size_t i) {
  const Restraint r = in.posed.rows.restraint[i];
  const JacobianRow& row = in.posed.rows.jacobian[i];
  const bool whole = std::max(row.body_a, row.body_b) < static_cast<Index>(in.o.start.size());
  return whole && (r == Restraint::equality || r == Restraint::inequality ||
                   in.posed.rows.tags[i].kind == RowKind::friction);
}

double contacts_beyond_bodies(const EnergyInput& in, const MeanVelocities& mean, bool driven) {
  double work = 0;
  for (std::size_t i = 0; i < in.o.contacts.size(); ++i) {
    const Contact& c = in.o.contacts[i];
    const bool passive = dissipates(c);
    if (passive && !driven && c.surface_velocity == Vec3{}) continue;
    const ContactImpulse impulse = to_world(c, &in.solved.solution.x[in.posed.problem->graph.first_row[i]]);
    const auto along = [&](const ContactImpulse& u) {
      return dot(impulse.linear, u.linear) + dot(impulse.angular, u.angular);
    };
    ContactImpulse moved = relative_motion(c, mean.moved);
    moved.linear -= c.surface_velocity;
    work += beyond_bodies(passive, along(relative_motion(c, mean.all)), along(moved));
  }
  return work;
}

double joints_beyond_bodies(const EnergyInput& in, const MeanVelocities& mean, bool driven) {
  const std::size_t first = in.posed.problem->rows() - in.posed.rows.tags.size();
  double work = 0;
  for (std::size_t i = 0; i < in.posed.rows.tags.size(); ++i) {
    const bool passive = dissipates(in, i);
    if (passive && !driven) continue;
    const JacobianRow& row = in.posed.rows.jacobian[i];
    work += in.solved.solution.x[first + i] *
            beyond_bodies(passive, row_velocity(row, mean.all), row_velocity(row, mean.moved));
  }
  return work;
}

BodyVelocity operator-(const BodyVelocity& v, const BodyVelocity& w) {
  return {v.linear - w.linear, v.angular - w.angular};
}

// <v, M w> of one body.
double inner_product(const EnergyInput& in, std::size_t body, const BodyVelocity& v, const BodyVelocity& w) {
  return in.step.model.description().bodies[body].mass * dot(v.linear, w.linear) +
         dot(v.angular, in.o.frames[body].inertia * w.angular);
}

bool in_tree(const EnergyInput& in, std::size_t body) {
  const auto& trees = std::get<ContactSystem>(in.posed.problem->A).constrained;
  return trees && trees->linkage->number_of(static_cast<Index>(body)) >= 0;
}

// Impulses act on the spin at the start; the mean spin of the step differs from it by the lag.
BodyVelocity with_lag(const EnergyInput& in, std::size_t body, const BodyVelocity& v) {
  return {v.linear, v.angular + in.o.spins[body].lag};
}

// Work of all impulses on bodies of trees along the mean velocities: of joints it is zero. The change of
// their velocities in the metric of the masses of bodies is not the impulse: M of trees has inertias of
// drives too.
double work_on_trees(const EnergyInput& in, const BodyVelocities& mean) {
  const auto& A = std::get<ContactSystem>(in.posed.problem->A);
  if (!A.constrained) return 0;
  const std::span<const double> w = impulses_on_bodies(*in.posed.problem, in.solved.solution.x);
  double work = 0;
  for (const Index i : A.constrained->body) {
    const double* at = &w[6 * static_cast<std::size_t>(i)];
    work += dot(Vec3{at[0], at[1], at[2]}, mean[i].linear) + dot(Vec3{at[3], at[4], at[5]}, mean[i].angular);
  }
  return work;
}

// Work J. The work of all impulses on a body is the change of its velocity that they cause, in the metric of
// its mass, along the mean velocity. It excludes the energy in the inertia that stiffening adds. A sum over
// the rows would agree except for rounding, but for torn joints this sum is only rounding.
EnergyBalance along_mean(const EnergyInput& in) {
  static thread_local MeanVelocities mean;  // kept: a step allocates nothing
  mean.all.resize(in.o.start.size());
  mean.moved.resize(in.o.start.size());
  double kinetic = 0, work = 0;
  bool driven = false;
  in.step.visited.bodies.each(mean.all.size(), [&](std::size_t i) {
    const BodyVelocity& start = in.o.start[i];
    if (!in.step.model.is_dynamic(static_cast<Index>(i))) {
      mean.all[i] = start;
      mean.moved[i] = {};
      driven |= !(start.linear == Vec3{} && start.angular == Vec3{});
      return;
    }
    const BodyVelocity after = with_lag(in, i, in.solved.after[i]);
    mean.all[i] =
        mean.moved[i] = {0.5 * (start.linear + after.linear), 0.5 * (start.angular + after.angular)};
    if (!in_tree(in, i)) work += inner_product(in, i, mean.all[i], in.solved.after[i] - in.o.free[i]);
    kinetic += 0.5 * (inner_product(in, i, start, start) + inner_product(in, i, after, after));
  });
  work += work_on_trees(in, mean.moved);
  const double fall = norm_squared(in.step.options.dt * in.step.model.description().gravity);
  const double recovered = in.step.recovery * in.step.recovery;
  return {work + contacts_beyond_bodies(in, mean, driven) + joints_beyond_bodies(in, mean, driven),
          base::policy.three_digits * kinetic + 0.5 * in.step.model.total_mass() * (fall + recovered)};
}

// J - J2, docs/algorithm.md (28): 1/2 (h f + D_m'x_m) . dv, with the rows m of motors, springs and compliant
// contacts, which J excludes from dissipation. J takes the work of passive rows along the mean velocity. J2
// takes it along v+, the actual motion, minus the 1/2 |dv|^2 that an implicit step loses. They differ if a
// foot bounced (u- > 0) and its motors press it back within the step. The contact then holds it (u+ = 0), and
// J credits the contact with x u- / 2 although nothing moved along x.
double along_motion(const EnergyInput& in) {
  static thread_local BodyVelocities change;
  change.assign(in.o.start.size(), {});
  double sum = 0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (!in.step.model.is_dynamic(static_cast<Index>(i))) continue;
    change[i] = with_lag(in, i, in.solved.after[i]) - in.o.start[i];
    sum += inner_product(in, i, with_lag(in, i, in.o.free[i]) - in.o.start[i], change[i]);
  }
  for (std::size_t i = 0; i < in.o.contacts.size(); ++i) {
    const Contact& c = in.o.contacts[i];
    if (dissipates(c)) continue;
    const ContactImpulse impulse = to_world(c, &in.solved.solution.x[in.posed.problem->graph.first_row[i]]);
    const ContactImpulse u = relative_motion(c, change);
    sum += dot(impulse.linear, u.linear - c.surface_velocity) + dot(impulse.angular, u.angular);
  }
  const std::size_t first = in.posed.problem->rows() - in.posed.rows.tags.size();
  for (std::size_t i = 0; i < in.posed.rows.tags.size(); ++i)
    if (!dissipates(in, i))
      sum += in.solved.solution.x[first + i] * row_velocity(in.posed.rows.jacobian[i], change);
  return 0.5 * sum;
}

}  // namespace

EnergyBalance energy_balance(const EnergyInput& in) {
  EnergyBalance balance = along_mean(in);
  if (!balance.holds()) balance.work = std::min(balance.work, balance.work - along_motion(in));
  return balance;
}

double work_along_mean(const EnergyInput& in) { return along_mean(in).work; }

}  // namespace amontons
