// A tendon is a coordinate l of many bodies: its length, with l' = J v. Forces along it have the rows of a
// degree of freedom, D = s J, all on one narrow row. In a spatial tendon J is exact although the contact
// points on obstacles move: to first order, moving them does not change the length of a shortest path.
#include "multibody/joints/tendons.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "multibody/joints/actuator_rows.hpp"
#include "multibody/joints/dof_rows.hpp"
#include "multibody/joints/ropes.hpp"

namespace amontons {
namespace {

// The whole length of a path.
Line spatial(const Model& model, const BodyFrames& bodies, const Tendon& tendon) {
  if (tendon.path.empty()) return {};
  TendonCourse course = course_of(model, bodies, tendon);
  Line line = std::move(course.parts.front());
  for (std::size_t i = 1; i < course.parts.size(); ++i) {
    line.length += course.parts[i].length;
    line.row.add(course.parts[i].row, 1);
  }
  return line;
}

// l' at the end of the last step: as rates_before, with the row for the poses at its start.
double rate_before(const RowInput& in, const Tendon& tendon, JointRows& rows) {
  double rate = 0;
  for (const TendonTerm& term : tendon.terms) {
    const std::span<const double> q = coordinates_of(in.model, in.state, term.joint);
    rate += term.coefficient * rates_before(in, in.joints[term.joint], q, rows)[term.dof];
  }
  if (tendon.path.empty()) return rate;
  BodyFrames frames = in.bodies.frames;
  BodyVelocities velocities = in.bodies.start;
  const std::vector<Past>& past = past_of(in, rows);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Past& then = past[i];
    frames[i].pose = then.pose;
    frames[i].centre = then.centre;
    velocities[i] = then.velocity;
  }
  return row_velocity(spatial(in.model, frames, tendon).row, velocities);
}

// A tendon, ready to make rows.
struct TendonRow {
  const Tendon& tendon;
  Index index;
  double s, length;
  double speed;               // D v|, the fastest known speed
  double rate, inverse_mass;  // l' at the start, of the row
  TendonImpulse last;         // along l
  NarrowRow narrow;

  RowTag tag(Index which, double sign = 1) const { return {RowKind::tendon, index, which, sign, {}, {}, s}; }
};
enum Part : Index { drive, spring, friction, limit };  // the order of TendonImpulse

// An end of the slack of the spring, or a limit. `sign` +1: the row of a gap that increases with the length.
void append_end(const RowInput& in, const TendonRow& t, double sign, double gap, Part part, JointRows& rows) {
  const std::size_t first = rows.c.size();
  const double compliance = part == spring ? 1 / t.tendon.stiffness : 0;
  const double last = part == spring ? t.last.spring : t.last.limit;
  append_inequality(in, {sign * t.narrow.row, sign * last / t.s, t.tag(part, sign)}, t.s * gap,
                    t.s * t.s * compliance, t.speed, rows);
  for (std::size_t i = first; i < rows.c.size(); ++i) rows.c[i] += sign * t.narrow.offset;
}

// A spring that is slack between two lengths is two inequalities with compliance, one pulling and one
// pushing.
void append_springs(const RowInput& in, const TendonRow& t, JointRows& rows) {
  const Tendon& d = t.tendon;
  Drive both{0, 0, d.damping, d.armature, d.armature > 0 ? rate_before(in, d, rows) : 0, 0, t.rate};
  if (d.rest_lower == d.rest_upper) {
    both.stiffness = d.stiffness;
    both.stretch = t.length - d.rest_lower;
  } else if (d.stiffness > 0) {
    append_end(in, t, 1, t.length - d.rest_lower, spring, rows);
    append_end(in, t, -1, d.rest_upper - t.length, spring, rows);
  }
  if (auto terms = drive_terms(both, t.s, t.inverse_mass, in.options)) {
    terms->c += t.narrow.offset;
    rows.append(Bilateral{}, t.narrow.row, *terms, t.last.passive / t.s, t.tag(drive));
  }
}

void append_limits(const RowInput& in, const TendonRow& t, double inverse_mass, JointRows& rows) {
  const Tendon& d = t.tendon;
  if (d.lower == d.upper) {
    RowTerms terms = equality_terms(t.s * (t.length - d.lower), 0, inverse_mass, in.options);
    terms.c += t.narrow.offset;
    return rows.append(Bilateral{}, t.narrow.row, terms, t.last.limit / t.s, t.tag(limit));
  }
  append_end(in, t, 1, t.length - d.lower, limit, rows);
  append_end(in, t, -1, d.upper - t.length, limit, rows);
}

// Whether a tendon has a row in this step; a slack string has none, and no helpers.
bool acts(const RowInput& in, const Tendon& d, double length, double s, double speed) {
  const auto near = [&](double gap) { return within_reach(s * gap, speed, in.options); };
  return d.stiffness > 0 || d.damping > 0 || d.friction > 0 || d.armature > 0 || near(length - d.lower) ||
         near(d.upper - length);
}

}  // namespace

// A sum of coordinates that are all angles, or all displacements, has an arbitrary unit by its coefficients.
// The largest coefficient is divided out, so that a limit is as near, and its violation as large, as that of
// the joint which moves the tendon most.
double tendon_scale(const Model& model, Index index) {
  const Tendon& tendon = model.description().tendons[index];
  const auto kind = [&](const TendonTerm& term) { return model.joint(term.joint).dofs[term.dof].kind; };
  const auto& terms = tendon.terms;
  const auto all = [&](Dof::Kind wanted) {
    return !terms.empty() &&
           std::all_of(terms.begin(), terms.end(), [&](const auto& t) { return kind(t) == wanted; });
  };
  const bool angles = all(Dof::Kind::hinge);
  if (!tendon.path.empty() || (!angles && !all(Dof::Kind::slide))) return 1;
  double largest = 0;
  for (const TendonTerm& term : terms) largest = std::max(largest, std::abs(term.coefficient));
  return largest > 0 ? (angles ? model.length() : 1) / largest : 1;
}

Line tendon_line(const Model& model, const BodyFrames& bodies, std::span<const JointContext> joints,
                 const State& state, Index index) {
  const Tendon& tendon = model.description().tendons[index];
  Line line = spatial(model, bodies, tendon);
  for (const TendonTerm& term : tendon.terms) {
    line.length += term.coefficient * state.coordinates[model.first_dof(term.joint) + term.dof];
    if (!is_active(model, model.joint(term.joint))) continue;
    const JointContext& context = joints[term.joint];
    line.row.add(joint_row(context, context.duals[term.dof]), term.coefficient);
  }
  return line;
}

Line tendon_line(const Model& model, const BodyFrames& bodies, const State& state, Index index) {
  JointContexts joints;
  place_joints(model, bodies, state, joints);
  return tendon_line(model, bodies, joints, state, index);
}

double tendon_length(const Model& model, const BodyFrames& bodies, const State& state, Index index) {
  const Tendon& tendon = model.description().tendons[index];
  double length = spatial(model, bodies, tendon).length;
  for (const TendonTerm& term : tendon.terms)
    length += term.coefficient * state.coordinates[model.first_dof(term.joint) + term.dof];
  return length;
}

double tendon_stretch(const Tendon& tendon, double length) {
  return length - std::clamp(length, tendon.rest_lower, tendon.rest_upper);
}

void append_tendon_rows(const RowInput& in, JointRows& rows) {
  const auto& tendons = in.model.description().tendons;
  std::size_t rubs = 0;
  for (std::size_t k = 0; k < tendons.size(); ++k) {
    const Tendon& d = tendons[k];
    const Index index = static_cast<Index>(k);
    if (const std::size_t own = rubs_of(d); own > 0) {
      append_rope_rows(in, index, rubs, rows);
      rubs += own;
      continue;
    }
    Line line = tendon_line(in.model, in.bodies.frames, in.joints, in.state, index);
    const double s = tendon_scale(in.model, index);
    line.row.scale(s);
    const double inverse_mass = inverse_effective_mass(line.row, in.bodies.mobility);
    if (inverse_mass == 0) continue;
    const double start = row_velocity(line.row, in.bodies.start);
    const double speed = std::max(std::abs(start), std::abs(row_velocity(line.row, in.bodies.free)));
    const auto& actuators = in.model.actuators_of_tendon(k);
    const auto pulls = [&](Index a) {
      return has_row({in.model, in.state, effort_controls(in), in.options.h}, a);
    };
    const bool pulled = std::any_of(actuators.begin(), actuators.end(), pulls);
    NarrowRow narrow;
    if (pulled || acts(in, d, line.length, s, speed)) {
      const TendonImpulse& last = in.state.tendon_impulses[k];
      double all = last.passive + last.spring + last.friction + last.limit;
      for (const Index a : actuators)
        all += in.model.description().actuators[a].transmission.gear * in.state.actuator_impulses[a];
      narrow = narrowed(line.row, in.bodies, all / s, {RowKind::tendon, index, -1}, rows);
      const TendonRow row{d, index, s, line.length, speed, start / s, inverse_mass, last, narrow};
      append_springs(in, row, rows);
      if (d.friction > 0)
        append_bounded(in.options.kick * d.friction / s, {narrow.row, last.friction / s, row.tag(friction)},
                       {0, narrow.offset}, rows);
      append_limits(in, row, inverse_mass, rows);
    }
    for (const Index a : actuators)
      append_actuator(in, a, {narrow.row, s, inverse_mass, line.length, start / s, narrow.offset}, rows);
  }
}

}  // namespace amontons
