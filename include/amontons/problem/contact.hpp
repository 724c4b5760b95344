#pragma once
#include <cmath>
#include <cstdint>

#include "amontons/base/math.hpp"

namespace amontons {

using Index = std::int32_t;  // SciPy's default index type

constexpr Index world = -1;  // as a body: the inertial frame

// Properties of a surface; for a contact, those that follow from both surfaces.
struct Material {
  double friction = 0.5;          // Coulomb's mu, >= 0; of a contact: that of this step
  double restitution = 0;         // e in [0, 1]: u_n^+ = -e u_n^-
  double compliance = 0;          // of one contact point, m/N, >= 0; 0: rigid
  double relaxation_time = 0;     // damping of a compliant contact over its stiffness, s, >= 0
  double rest_offset = 0;         // distance at which two surfaces touch, m, >= 0
  double friction_across = -1;    // mu across the friction direction; negative: equal in all directions
  double torsional_friction = 0;  // largest moment about the normal over the normal force, m
  double rolling_friction = 0;    // the same for moments in the tangent plane, m
  double friction_static = -1;    // mu of a contact that stuck in the last step; negative: `friction`
  double stribeck_speed = 0;      // slip at which mu has fallen towards `friction`, m/s; 0: at once
  constexpr bool operator==(const Material&) const = default;
};

enum class ContactState : unsigned char { open, stick, slip };

// The part of a contact that a solver reads: bodies, a frame and rows. Passes over many contacts wait for
// memory, so that a problem keeps this part alone.
struct ContactGeometry {
  Index body_a = world, body_b = world;
  int rows = 3;    // normal, two tangents; 4: and a moment about the normal; 5: and two about the tangents;
                   // 6: all three
  Vec3 normal;     // unit length, from B to A
  Vec3 r_a, r_b;   // from each centre of mass (the origin for the world) to the point, m
  Vec3 direction;  // of the first friction coefficient; zero for isotropic friction
  double moment_length = 1;  // length by which moments are divided and spins multiplied in the rows, m
};

// One contact point, from its detection to the user's table: A and B touch, or nearly touch, at `point`. All
// vectors are in world axes; impulses act on A, and their opposite on B. The normal points from B to A, so
// that a positive normal impulse pushes A away and a positive normal velocity opens the contact.
//
// The contact search fills its geometry and the first part, the solve of the step the second.
struct Contact : ContactGeometry {
  Index geom_a = -1, geom_b = -1;
  double gap = 0;         // m, at the start of the step, > 0: open; minus the material's rest_offset
  Vec3 surface_velocity;  // of A's surface over its body minus that of B's, tangential, m/s
  Material material;
  Vec3 point;  // m
  Vec3 held;   // for a compliant contact: impulse of the last step in units of this one, N s

  // Results of a step; impulses include those of impacts at its start.
  Vec3 impulse, angular_impulse;  // N s, and N m s about the point
  Vec3 slip;                      // tangential velocity of A's surface relative to B's after the step, m/s
  Vec3 spin;                      // angular velocity of A relative to B after the step, rad/s
  double normal_velocity = 0;     // n . (v_A - v_B) after the step, m/s
  ContactState state = ContactState::open;
};

// Makes a contact from the data that a solver needs; the rest has its defaults.
inline Contact contact_between(Index body_a, Index body_b, const Vec3& r_a, const Vec3& r_b,
                               const Vec3& normal) {
  Contact c;
  c.body_a = body_a;
  c.body_b = body_b;
  c.r_a = r_a;
  c.r_b = r_b;
  c.normal = normal;
  return c;
}

// The frame of a contact, right-handed: the normal and two tangents. Rows are (normal, tangent 1, tangent 2),
// then moments about them. The frame is a function of the contact and is never stored, so that all code uses
// the same tangents.
struct ContactBasis {
  Vec3 normal, tangent_1, tangent_2;

  // Tangents that follow from the normal alone, smoothly except at the change of sign of n_z (Duff et al.,
  // "Building an orthonormal basis, revisited", JCGT 2017).
  explicit ContactBasis(const Vec3& n) : normal(n) {
    const double sign = std::copysign(1.0, n.z);
    const double a = -1.0 / (sign + n.z);
    const double b = n.x * n.y * a;
    tangent_1 = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    tangent_2 = {b, sign + n.y * n.y * a, -n.y};
  }
  // The first tangent is along `direction`, unless that is zero or parallel to the normal.
  ContactBasis(const Vec3& n, const Vec3& direction) : ContactBasis(n) {
    if (!(direction == Vec3{})) turn_to(direction);
  }
  explicit ContactBasis(const ContactGeometry& c) : ContactBasis(c.normal, c.direction) {}

  Vec3 to_world(const double* x) const { return x[0] * normal + x[1] * tangent_1 + x[2] * tangent_2; }
  // The rows of a world vector: the transpose, as the basis is orthonormal.
  void to_contact(const Vec3& v, double* x) const {
    x[0] = dot(normal, v);
    x[1] = dot(tangent_1, v);
    x[2] = dot(tangent_2, v);
  }
  const Vec3& axis(int k) const { return k == 0 ? normal : k == 1 ? tangent_1 : tangent_2; }

 private:
  // Not inline: few contacts have a direction, and every pass over contacts makes their frames.
  void turn_to(const Vec3& direction);
};

// Row k of a contact: its axis, and whether it is a moment about that axis.
//  rows 3   n t1 t2
//  rows 4   n t1 t2, moment about n
//  rows 5   n t1 t2, moments about t1 t2
//  rows 6   n t1 t2, moments about n t1 t2
struct ContactRow {
  int axis;
  bool moment;
};
constexpr ContactRow contact_row(int rows, int k) {
  if (k < 3) return {k, false};
  return {rows == 5 ? k - 2 : k - 3, true};
}

// The impulse, and the angular impulse about the point, from the rows x of a contact; and the rows of a
// relative velocity and spin. x has c.rows entries, all in N s or m/s. With the length l, a moment row holds
// tau / l for an angular impulse tau and l omega for a spin: the power <x, u> is unchanged.
struct ContactImpulse {
  Vec3 linear, angular;
};
inline ContactImpulse to_world(const ContactGeometry& c, const double* x) {
  const ContactBasis basis(c);
  ContactImpulse f{basis.to_world(x), {}};
  for (int k = 3; k < c.rows; ++k)
    f.angular += (c.moment_length * x[k]) * basis.axis(contact_row(c.rows, k).axis);
  return f;
}
// Converts velocities (u, omega) to rows with angular_scale = l, impulses (f, tau) with 1 / l.
inline void to_rows(const ContactGeometry& c, const Vec3& linear, const Vec3& angular, double angular_scale,
                    double* x) {
  const ContactBasis basis(c);
  basis.to_contact(linear, x);
  for (int k = 3; k < c.rows; ++k)
    x[k] = angular_scale * dot(basis.axis(contact_row(c.rows, k).axis), angular);
}

}  // namespace amontons
