// docs/algorithm.md (29): impulses x act along the mean of the velocities before and after them: their work
// is x' (u- + u+) / 2 with u = D v, and for any x it is the change of the kinetic energy that is theirs. Of a
// contact u has the velocity of its surfaces, and bodies that are driven move in it: what they do to others
// is no energy from nothing.
#include "multibody/step/energy_guard.hpp"

#include <algorithm>
#include <cmath>

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
// Of the work of motors and springs, where joints have turned: see across_joints.
constexpr double of_drives = 0.05;

// Of an impulse along a row or at a contact: the work that can only dissipate less the work on bodies that
// impulses move. Where no other moves (`driven`) that is nothing, and what can only dissipate need not be
// looked at.
double beyond_bodies(bool dissipates, double of_all, double of_moved) {
  return dissipates ? of_all - of_moved : -of_moved;
}

double contacts_beyond_bodies(const EnergyInput& in, const EnergyScratch& mean, bool driven) {
  const auto& contacts = std::get<ContactSystem>(in.problem.A).contacts;
  double work = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    // A compliant contact is a spring, which gives back what it has.
    const bool dissipates = !(c.material.compliance > 0);
    if (dissipates && !driven && c.surface_velocity == Vec3{}) continue;
    const ContactImpulse impulse = to_world(c, &in.solution.x[in.problem.graph.first_row[i]]);
    const auto along = [&](const ContactImpulse& u) {
      return dot(impulse.linear, u.linear) + dot(impulse.angular, u.angular);
    };
    ContactImpulse moved = relative_motion(c, mean.moved);
    moved.linear -= c.surface_velocity;
    work += beyond_bodies(dissipates, along(relative_motion(c, mean.all)), along(moved));
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

double joints_beyond_bodies(const EnergyInput& in, const EnergyScratch& mean, bool driven) {
  const std::size_t first = in.problem.rows() - in.rows.tags.size();
  double work = 0;
  for (std::size_t i = 0; i < in.rows.tags.size(); ++i) {
    const Restraint r = in.rows.restraint[i];
    const JacobianRow& row = in.rows.jacobian[i];
    const bool passive = r == Restraint::equality || r == Restraint::inequality;
    // A row over many bodies is several over auxiliary ones, whose work is counted by none.
    const bool whole = std::max(row.body_a, row.body_b) < static_cast<Index>(mean.all.size());
    const bool dissipates = whole && (passive || in.rows.tags[i].kind == RowKind::friction);
    if (dissipates && !driven) continue;
    work += in.solution.x[first + i] *
            beyond_bodies(dissipates, row_velocity(row, mean.all), row_velocity(row, mean.moved));
  }
  return work;
}

// What drives seem to do more as joints have turned: the work of the locked directions along velocities of
// the start that run across them, which is of second order in the step. Let v_p be the velocities of the
// start without that part, the projection onto the joints. Locked directions do no work along (v_p + v+) / 2,
// and v_p has less energy than v-; so nothing comes from nothing where the drives, along that mean, account
// for the rest. The work along (v- + v+) / 2 differs from that by
//   (energy of v_p less that of v-) + (work of the loads along (v_p - v-) / 2) = x' D v- / 2.
// Gyroscopic moments are loads, too, which may do no work at all: a share of the work of the drives at most.
double across_joints(const EnergyInput& in, const EnergyScratch& mean) {
  const std::size_t first = in.problem.rows() - in.rows.tags.size();
  double across = 0, driven = 0;
  for (std::size_t i = 0; i < in.rows.tags.size(); ++i) {
    const JacobianRow& row = in.rows.jacobian[i];
    const Restraint r = in.rows.restraint[i];
    const double x = in.solution.x[first + i];
    const bool whole = std::max(row.body_a, row.body_b) < static_cast<Index>(in.start.size());
    if (!whole) continue;
    if (r == Restraint::equality)
      across += 0.5 * x * row_velocity(row, in.start);
    else if (r != Restraint::inequality && in.rows.tags[i].kind != RowKind::friction)
      driven += std::abs(x * row_velocity(row, mean.all));
  }
  return std::clamp(across, 0.0, of_drives * driven);
}

// The work of all impulses on a body is the change that they make of its velocity, in the measure of its
// mass, along the mean velocity: what inertia that stiffening adds takes up is no part of it. Summed over the
// rows it would be the same but for rounding, which is all that is left of it where joints are torn.
EnergyBalance along_mean(const EnergyInput& in, EnergyScratch& mean) {
  mean.all = in.start;
  mean.moved.assign(in.start.size(), {});
  double kinetic = 0, gravity = 0, recovered = 0, changed = 0, loads = 0, work = 0;
  bool driven = false;
  for (std::size_t i = 0; i < mean.all.size(); ++i) {
    if (!in.model.is_dynamic(static_cast<Index>(i))) {
      driven |= !(in.start[i].linear == Vec3{} && in.start[i].angular == Vec3{});
      continue;
    }
    const double mass = in.model.description().bodies[i].mass;
    const Mat3& inertia = in.frames[i].inertia;
    const auto product = [&](const BodyVelocity& v, const BodyVelocity& w) {
      return mass * dot(v.linear, w.linear) + dot(v.angular, inertia * w.angular);
    };
    const auto less = [](const BodyVelocity& v, const BodyVelocity& w) {
      return BodyVelocity{v.linear - w.linear, v.angular - w.angular};
    };
    // Impulses act on the spin of the start, of which the mean over the step is short by the lag.
    const BodyVelocity& start = in.start[i];
    const BodyVelocity after{in.after[i].linear, in.after[i].angular + in.spins[i].lag};
    const BodyVelocity change = less(after, start), load = less(in.free[i], start);
    mean.all[i] = mean.moved[i] = {start.linear + 0.5 * change.linear, start.angular + 0.5 * change.angular};
    work += product(mean.all[i], less(in.after[i], in.free[i]));
    kinetic += 0.5 * (product(start, start) + product(after, after));
    changed += 0.5 * product(change, change);
    loads += 0.5 * product(load, load);
    gravity += 0.5 * mass * norm_squared(in.dt * in.model.description().gravity);
    recovered += 0.5 * mass * in.recovery * in.recovery;
  }
  return {work + contacts_beyond_bodies(in, mean, driven) + joints_beyond_bodies(in, mean, driven),
          of_motion * kinetic + of_gravity * gravity + of_change * changed + of_loads * loads + recovered +
              std::min(closing_work(in), of_gravity * gravity)};
}

}  // namespace

// The work across joints is looked at where it matters.
EnergyBalance energy_balance(const EnergyInput& in, EnergyScratch& mean) {
  EnergyBalance balance = along_mean(in, mean);
  if (!balance.holds()) balance.work -= across_joints(in, mean);
  return balance;
}

// Along s x the work is a s + c s^2, which its values at 1 and 1/2 tell; the largest s in [0, 1] with work 0
// is -a / c where a < 0. Else no contact pushes for a step, and what they miss is an error of position, which
// the following steps take back; joints and springs, which are linear, are held exactly, before and after
// that (`settle`): a spring that does nothing while it is stretched takes up energy that nobody gave. Where
// not even they can be held, bodies fly on freely.
EnergyBalance take_back(const EnergyInput& in, EnergyBalance balance, Elimination& elimination,
                        const Options& options, Solution& solution, BodyVelocities& after,
                        EnergyScratch& scratch) {
  const std::vector<double> x = solution.x;
  const auto look = [&] {
    after = in.free;
    apply_impulses(in.problem, solution.x, after);
    EnergyBalance now = along_mean(in, scratch);
    now.work -= across_joints(in, scratch);
    return now;
  };
  const auto scale = [&](double s) {
    for (std::size_t i = 0; i < x.size(); ++i) solution.x[i] = s * x[i];
    project(in.problem.K, solution.x, solution.x);  // intervals without zero
    solution.u.clear();
  };
  const auto settled = [&](double s) {
    scale(s);
    return elimination.settle(in.problem, options, solution) && (balance = look()).holds();
  };
  const double whole = balance.work;
  // What had no time is settled as it is.
  if (solution.status != Status::deadline && settled(1)) return balance;
  scale(0.5);
  const double half = look().work;
  const double a = 4 * half - whole, c = 2 * whole - 4 * half;
  if (a < 0 && c > 0) {
    scale(std::min(1.0, -a / c));
    if ((balance = look()).holds()) return balance;
  }
  if (settled(0)) return balance;
  scale(0);
  return look();
}

}  // namespace amontons
