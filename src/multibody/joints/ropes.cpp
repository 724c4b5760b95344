// Ropes with friction on pulleys (Euler, Eytelwein). An element of rope that turns by d(angle) presses with
// T d(angle) on the pulley, and slips if the tension changes by mu T d(angle). So a rope that slips has T_1 /
// T_2 = exp(mu angle). Otherwise the ratio lies between that and its inverse.
//
// T_1 and T_2 act on the rates l_1' and l_2' of the parts before and after the pulley. Each part ends where
// the rope meets the pulley, at a point of the pulley. The rows are
//   u_n = -(l_1' + l_2'),   u_t = -(l_1' - l_2').
// Their impulses are n = h (T_1 + T_2) / 2 and t = h (T_1 - T_2) / 2. With g = mu angle the bounds are
//   T_1 - T_2 <= (e^g - 1) / (e^g + 1) (T_1 + T_2),   that is   |t| <= tanh(g / 2) n.
// u_n >= 0 says that the rope does not lengthen. u_t is twice its slip on the pulley. So the law of the rope
// is Coulomb's law in these rows: it dissipates the most, and the length stays (the De Saxce term).
//
// The pulley gets T_1 and T_2 at the two points, along the rope. Their sum loads its axle, and their moment
// (T_1 - T_2) r turns it, against the friction of its own joint.
//
// Two rubs share the part between them. It has a knot, whose velocity z along the rope is unknown: the left
// rub sees the rate of the part plus z, the right one -z. The knot has next to no mass, so that both rubs see
// the same tension. It is a component of an auxiliary body, like the helpers of a row over many bodies
// (wide_rows). It moves with the rope at the start of the step, so that uniform motion needs no impulse.
#include "multibody/joints/ropes.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "multibody/joints/policy.hpp"

namespace amontons {
namespace {

// tanh(x / 2) = (e^x - 1) / (e^x + 1). Beyond 40 it rounds to 1, a rope that cannot slip.
double ratio_of(double grip) {
  if (grip > 40) return 1;  // not tuned: rounding
  const double e = elementary::expm1(grip);
  return e / (e + 2);
}

// Both sides of a rub: what the bodies add to the rates, and the components of the auxiliary body.
struct Side {
  WideRow bodies;
  std::vector<std::pair<int, double>> helpers;  // component, sign
  double offset = 0;                            // of the rate, from the start of helpers
};
struct Place {
  double ratio;
  Index body;
  Side left, right;
};

// The components of the auxiliary body of one rope.
struct Helpers {
  const RowInput& in;
  Index tendon, body;
  int used = 0;
  JointRows& rows;

  // check_rope (model/description) admits only ropes whose helpers fit.
  int next() { return used++; }
  // A component that follows the part of one body in a side.
  void follow(const WideRow& from, std::size_t i, Side& side) {
    JacobianRow link = from.part(i);
    const double start = row_velocity(link, in.bodies.start);
    const int component = next();
    link.body_b = body;
    link.b[component] = -1;
    side.helpers.emplace_back(component, 1.0);
    side.offset += start;
    rows.append(Bilateral{}, link, {0, -start, Restraint::held}, 0, {RowKind::tendon, tendon, -1});
  }
};

// The bodies of both sides, in order of appearance.
std::vector<Index> bodies_of(const Place& p) {
  std::vector<Index> all = p.left.bodies.body;
  for (const Index body : p.right.bodies.body)
    if (std::find(all.begin(), all.end(), body) == all.end()) all.push_back(body);
  return all;
}

// Parts to the sides of their rubs. A part between two rubs gives the second one what its own body adds, and
// the rest to the first: how they are shared changes only what the knot is.
std::vector<Place> places_of(const TendonCourse& course) {
  std::vector<Place> places;
  for (const Rub& rub : course.rubs) places.push_back({ratio_of(rub.grip), rub.body, {}, {}});
  places.front().left.bodies = course.parts.front().row;
  places.back().right.bodies = course.parts.back().row;
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {
    const WideRow& part = course.parts[i + 1].row;
    for (std::size_t k = 0; k < part.body.size(); ++k) {
      Side& side = part.body[k] == places[i + 1].body ? places[i + 1].left : places[i].right;
      side.bodies.add(part.body[k], part.j[k], 1);
    }
  }
  return places;
}

// A knot between each two rubs. It starts so that no part of the rope lengthens.
void add_knots(const RowInput& in, std::vector<Place>& places, Helpers& helpers) {
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {
    Side &here = places[i].right, &next = places[i + 1].left;
    const auto rate = [&](const Side& side) {
      return row_velocity(side.bodies, in.bodies.start) + side.offset;
    };
    const double start = -(rate(places[i].left) + rate(here));
    const int component = helpers.next();
    here.helpers.emplace_back(component, 1.0);
    next.helpers.emplace_back(component, -1.0);
    here.offset += start;
    next.offset -= start;
  }
}

// One body of a place acts in its rows directly, with the auxiliary body as the other one.
void follow_others(std::vector<Place>& places, Helpers& helpers) {
  for (Place& p : places) {
    const std::vector<Index> all = bodies_of(p);
    if (all.empty()) continue;
    const Index direct = std::find(all.begin(), all.end(), p.body) != all.end() ? p.body : all.front();
    for (Side* side : {&p.left, &p.right}) {
      const WideRow from = side->bodies;
      side->bodies = {};
      for (std::size_t k = 0; k < from.body.size(); ++k)
        if (from.body[k] == direct)
          side->bodies.add(from.body[k], from.j[k], 1);
        else
          helpers.follow(from, k, *side);
    }
  }
}

// -(left + sign right) as a row of two bodies: the one that acts directly and another, or the auxiliary one.
// Both rows of a place have the same two, as a block must.
JacobianRow row_of(const Place& p, double sign, Index auxiliary) {
  JacobianRow row{world, world, {}, {}};
  const std::vector<Index> all = bodies_of(p);
  if (!all.empty()) row.body_a = all.front();
  row.body_b = auxiliary >= 0 ? auxiliary : all.size() > 1 ? all[1] : world;
  for (const auto& [side, s] : {std::pair{&p.left, 1.0}, std::pair{&p.right, sign}}) {
    for (std::size_t k = 0; k < side->bodies.body.size(); ++k) {
      auto& to = side->bodies.body[k] == row.body_a ? row.a : row.b;
      for (int i = 0; i < 6; ++i) to[i] -= s * side->bodies.j[k][i];
    }
    for (const auto& [component, helper_sign] : side->helpers) row.b[component] -= s * helper_sign;
  }
  // A row whose only body is the auxiliary one has it first.
  if (row.body_a < 0 && row.body_b >= 0) {
    std::swap(row.body_a, row.body_b);
    std::swap(row.a, row.b);
  }
  return row;
}

// E, c and position of the first n row, whose impulse over the kick K is K times the mean tension T. A spring
// k that pulls beyond its rest length has T = k (stretch + h l'). From u_n = -l' + E n + c = 0 follow
//   E = 1 / (K h k),  c = -stretch / h.
// A given length is the inequality of any limit: a rope of a given length, or a spring that only pulls.
RowTerms rope_terms(const RowInput& in, const Tendon& d, double length) {
  const double h = in.options.h;
  if (d.stiffness > 0) return {1 / (in.options.kick * h * d.stiffness), -(length - d.rest_upper) / h};
  return {0, closing(d.upper - length, in.options), Restraint::inequality, d.upper - length};
}

// u_n and u_t of one place. The rates at the start of its helpers are not in the Jacobian, because auxiliary
// bodies start at rest; they are part of c.
void append_place(const RowInput& in, const Place& p, Index auxiliary, RowTerms terms, std::size_t number,
                  JointRows& rows) {
  const double before = p.left.offset, after = p.right.offset;
  terms.c -= before + after;
  const auto start = [&](int k) { return in.state.rub_impulses[2 * number + k]; };
  const auto tag = [&](int k) { return RowTag{RowKind::rub, static_cast<Index>(2 * number) + k, k}; };
  rows.append_block(PlanarFriction{p.ratio},
                    {BlockRow{row_of(p, 1, auxiliary), terms, start(0), tag(0)},
                     BlockRow{row_of(p, -1, auxiliary), {0, after - before}, start(1), tag(1)}});
}

}  // namespace

void append_rope_rows(const RowInput& in, Index tendon, std::size_t first, JointRows& rows) {
  const Tendon& d = in.model.description().tendons[tendon];
  const TendonCourse course = course_of(in.model, in.bodies.frames, d);
  WideRow whole;
  double length = 0, lightest = 0;
  for (const Line& part : course.parts) {
    length += part.length;
    for (std::size_t k = 0; k < part.row.body.size(); ++k) {
      whole.add(part.row.body[k], part.row.j[k], 1);
      lightest = std::max(lightest, side_inverse_mass(part.row.j[k], in.bodies.mobility[part.row.body[k]]));
    }
  }
  if (lightest == 0) return;  // no body moves
  const double speed =
      std::max(std::abs(row_velocity(whole, in.bodies.start)), std::abs(row_velocity(whole, in.bodies.free)));
  const double gap = d.stiffness > 0 ? d.rest_upper - length : d.upper - length;
  if (!within_reach(gap, speed, in.options)) return;  // a slack rope
  std::vector<Place> places = places_of(course);
  // Two bodies fit into a row: a rope over a fixed drum, or a belt, needs no helpers and is exact.
  const bool narrow = places.size() == 1 && bodies_of(places.front()).size() <= 2;
  Index auxiliary = world;
  if (!narrow) {
    rows.auxiliary_inverse_mass.push_back(lightest / joints::policy.auxiliary_mass);
    auxiliary = static_cast<Index>(in.bodies.frames.size() + rows.auxiliary_inverse_mass.size() - 1);
    Helpers helpers{in, tendon, auxiliary, 0, rows};
    follow_others(places, helpers);
    add_knots(in, places, helpers);
  }
  RowTerms terms = rope_terms(in, d, length);
  for (std::size_t i = 0; i < places.size(); ++i) {
    append_place(in, places[i], auxiliary, terms, first + i, rows);
    // The first rub keeps the length; at the others rope only passes.
    terms = {0, 0, d.stiffness > 0 ? Restraint::none : Restraint::inequality, 0};
  }
}

}  // namespace amontons
