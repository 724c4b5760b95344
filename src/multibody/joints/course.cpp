#include "multibody/joints/course.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "amontons/base/elementary.hpp"
#include "amontons/base/policy.hpp"
#include "multibody/joints/wrapping.hpp"

namespace amontons {
namespace {

using Kind = PathElement::Kind;

// A point that a body carries, in the world.
struct Stop {
  Index body;
  Vec3 at;
};

Vec3 in_world(const BodyFrames& bodies, Index body, const Vec3& point) {
  return body < 0 ? point : bodies[body].pose(point);
}
Transform in_world(const BodyFrames& bodies, const PathElement& e) {
  return (e.body < 0 ? Transform{} : bodies[e.body].pose) * e.frame;
}

// A straight part from p to q: l' = <d, v_q - v_p> with d its direction. If its ends coincide it has no
// direction and no force. Returns d.
Vec3 add_straight(const Model& model, const BodyFrames& bodies, const Stop& p, const Stop& q, double share,
                  Line& line) {
  const Vec3 way = q.at - p.at;
  const double length = norm(way);
  line.length += share * length;
  if (!(length > base::policy.rounding * model.length())) return {};
  const Vec3 d = way / length;
  if (p.body == q.body) return d;
  for (const auto& [stop, sign] : {std::pair{&q, 1.0}, std::pair{&p, -1.0}}) {
    if (stop->body < 0 || model.body(stop->body).motion == Motion::still) continue;
    const Vec3 m = cross(stop->at - bodies[stop->body].centre, d);
    line.row.add(stop->body, {d.x, d.y, d.z, m.x, m.y, m.z}, sign * share);
  }
  return d;
}

// The angle by which a rope turns on a cylinder: its curvature times its length. A helix of pitch angle a has
// the curvature cos(a)^2 / r, so that its length counts as cos(a)^2 / r.
double wrapped_angle(const Wrap& bend, const PathElement& e, const Transform& frame) {
  if (!(bend.length > 0)) return 0;
  const Vec3 axis = rotate(frame.rotation, {0, 0, 1});
  const double rise = e.kind == Kind::cylinder ? dot(bend.last - bend.first, axis) / bend.length : 0;
  return bend.length / e.radius * (1 - rise * rise);
}

// From point to point; an obstacle between two of them may bend the path. Its curved part moves with the
// obstacle's body and has no rate of its own. The ends of both neighbours are points of that body: without
// friction its turn cancels, with friction it is what the rope slips against.
struct Walk {
  const Model& model;
  const BodyFrames& bodies;
  TendonCourse course{{Line{}}, {}};
  std::optional<Stop> before{};
  Vec3 arriving{};
  const PathElement* obstacle = nullptr;
  const PathElement* eye = nullptr;  // a rubbing point whose angle the next straight part decides
  double share = 1;

  Line& line() { return course.parts.back(); }
  // Ends a part. The next one is on the other side of the rub, with a tension of its own.
  void rub(Index body, double grip) {
    course.rubs.push_back({body, grip});
    course.parts.emplace_back();
  }
  // The bend of a rope at an eye is known only when it leaves: the angle between the direction in which it
  // arrives and that in which it goes on. A rope that turns back has pi.
  void straight(const Stop& p, const Stop& q) {
    const Vec3 d = add_straight(model, bodies, p, q, share, line());
    if (eye) {
      const double angle = elementary::atan2(norm(cross(arriving, d)), dot(arriving, d));
      course.rubs.back().grip = eye->friction * angle;
      eye = nullptr;
    }
    arriving = d;
  }
  // A frictionless obstacle bends the part and goes on with it. One that rubs divides it in the middle of the
  // arc; the length of the arc belongs to the part before, and has no rate. Full turns add to arc and angle.
  void pass_obstacle(const Stop& here) {
    const PathElement& e = *obstacle;
    const Transform frame = in_world(bodies, e);
    std::optional<Vec3> side;
    if (e.side) side = in_world(bodies, e.side_body, *e.side);
    const std::optional<Wrap> bend = wrap(before->at, here.at, e.kind, frame, e.radius, side);
    if (bend) {
      straight(*before, {e.body, bend->first});
      line().length += share * bend->length;
      const double turns = 2 * std::numbers::pi * e.turns;
      line().length += share * turns * e.radius;
      if (e.friction > 0) rub(e.body, e.friction * (wrapped_angle(*bend, e, frame) + turns));
      straight({e.body, bend->last}, here);
      return;
    }
    straight(*before, here);
    if (e.friction > 0) rub(e.body, 0);  // the rope passes clear of it
  }
  // After a pulley that divides the path, the next point starts again. The tension is the same beyond it, and
  // so is the part.
  void pass(const PathElement& e) {
    if (e.kind == Kind::pulley) {
      share = 1 / e.divisor;
      before.reset();
      return;
    }
    if (e.kind != Kind::point) {
      obstacle = &e;
      return;
    }
    const Stop here{e.body, in_world(bodies, e.body, e.frame.position)};
    if (before && obstacle)
      pass_obstacle(here);
    else if (before)
      straight(*before, here);
    if (e.friction > 0) {
      rub(e.body, 0);
      eye = &e;
    }
    before = here;
    obstacle = nullptr;
  }
};

// A belt around two parallel cylinders, outside of both. With the line of centres e and f normal to it, the
// outer normals of both spans are sin b e +- cos b f, sin b = (R_1 - R_2) / distance. The belt turns by pi +
// 2 b on the first cylinder and by pi - 2 b on the second. It slips where its grip is less.
// The friction of both arcs is a bound on the same two tensions, so that the weaker one counts.
TendonCourse belt(const Model& model, const BodyFrames& bodies, const Tendon& tendon) {
  const PathElement &one = tendon.path[0], &two = tendon.path[1];
  const Transform a = in_world(bodies, one), b = in_world(bodies, two);
  const Vec3 axis = rotate(a.rotation, {0, 0, 1});
  Vec3 between = b.position - a.position;
  between = between - dot(between, axis) * axis;
  const double distance = norm(between);
  const Vec3 e = between / distance, f = cross(axis, e);
  const double sine = std::clamp((one.radius - two.radius) / distance, -1.0, 1.0);
  const double cosine = std::sqrt(1 - sine * sine), tilt = 2 * elementary::asin(sine);
  TendonCourse course{{Line{}, Line{}}, {}};
  // A span touches both cylinders where its outer normal points.
  for (int k = 0; k < 2; ++k) {
    const Vec3 normal = sine * e + (k == 0 ? cosine : -cosine) * f;
    add_straight(model, bodies, {one.body, a.position + one.radius * normal},
                 {two.body, b.position + two.radius * normal}, 1, course.parts[k]);
  }
  const double on_one = std::numbers::pi + tilt, on_two = std::numbers::pi - tilt;
  course.parts[0].length += on_one * one.radius + on_two * two.radius;
  course.rubs.push_back({one.body, std::min(one.friction * on_one, two.friction * on_two)});
  return course;
}

}  // namespace

std::size_t rubs_of(const Tendon& tendon) {
  if (tendon.closed) return 1;
  return static_cast<std::size_t>(std::count_if(tendon.path.begin(), tendon.path.end(),
                                                [](const PathElement& e) { return e.friction > 0; }));
}

TendonCourse course_of(const Model& model, const BodyFrames& bodies, const Tendon& tendon) {
  if (tendon.closed) return belt(model, bodies, tendon);
  Walk walk{model, bodies};
  for (const PathElement& element : tendon.path) walk.pass(element);
  return std::move(walk.course);
}

}  // namespace amontons
