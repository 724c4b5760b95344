// Why a search needs to know of seams: see Seams. Judged by geometry alone, at the start of the step; what is
// passed in one step is looked at again in the next.
#include "multibody/contacts/seams.hpp"

#include <algorithm>

#include "amontons/collision/narrow/extent.hpp"
#include "multibody/contacts/contact_law.hpp"

namespace amontons {

namespace {

// Faces whose heights differ by less are level: far above the error of a resting body, far below what a
// margin is taken for.
double level_of(double margin) { return 0.01 * margin; }

// With a lowest point that means something: spheres roll over a seam anyway, and static shapes are no slabs.
bool is_solid(const Shape& shape) { return !is_static_only(shape) && !std::holds_alternative<Sphere>(shape); }

// Whether a contact that is still open would close within the step, between two solids of which B does not
// move: the only ones that a body may pass instead.
bool may_pass(const Reach& reach, const Contact& contact) {
  const Model& model = reach.model;
  const double closing = reach.h * dot(contact.normal, relative_motion(contact, reach.v).linear);
  return contact.gap >= -level_of(reach.margin) && !model.is_dynamic(contact.body_b) &&
         contact.gap + closing < 0 && is_solid(model.geom(contact.geom_a).shape) &&
         is_solid(model.geom(contact.geom_b).shape);
}

}  // namespace

void Seams::start(const std::vector<Contact>& contacts) {
  by_body_.clear();
  known_ = contacts.size();
}

// Of what A rests on, every neighbour of the geom that it would strike is tried: the body B is the same, the
// geom another, the gap level and the normal across that of the contact. Then A passes if its lowest point
// along the neighbour's normal stands above the highest of the geom, both sought near the contact: a slab
// that is lower somewhere else, or higher, does not matter there.
bool Seams::passes(const Reach& reach, const std::vector<Transform>& frames,
                   const std::vector<Contact>& contacts, const Contact& contact) {
  if (!may_pass(reach, contact)) return false;
  if (by_body_.empty()) {
    by_body_.resize(known_);
    for (std::size_t i = 0; i < known_; ++i) by_body_[i] = i;
    std::stable_sort(by_body_.begin(), by_body_.end(),
                     [&](std::size_t i, std::size_t j) { return contacts[i].body_a < contacts[j].body_a; });
  }
  const Shape &a = reach.model.geom(contact.geom_a).shape, &b = reach.model.geom(contact.geom_b).shape;
  const double level = level_of(reach.margin);
  auto k = std::partition_point(by_body_.begin(), by_body_.end(),
                                [&](std::size_t i) { return contacts[i].body_a < contact.body_a; });
  for (; k != by_body_.end() && contacts[*k].body_a == contact.body_a; ++k) {
    const Contact& rest = contacts[*k];
    if (rest.body_b != contact.body_b || rest.geom_b == contact.geom_b) continue;
    if (std::abs(rest.gap) > level || dot(rest.normal, contact.normal) > 0.5) continue;
    const Vec3& up = rest.normal;
    const double lowest = -extent_along(a, frames[contact.geom_a], -up, contact.point),
                 highest = extent_along(b, frames[contact.geom_b], up, contact.point);
    if (lowest - highest >= -level) return true;
  }
  return false;
}

}  // namespace amontons
