#include "multibody/contacts/seams.hpp"

#include <algorithm>

#include "amontons/collision/narrow/extent.hpp"
#include "multibody/contacts/contact_law.hpp"

namespace amontons {

namespace {

// Faces whose heights differ by less are level.
double level_of(double margin) { return 0.01 * margin; }

bool is_solid(const Shape& shape) { return !is_static_only(shape) && !std::holds_alternative<Sphere>(shape); }

// Whether a contact that is still open would close within the step, between two solids of which B does not
// move: the only ones that a body may pass instead.
bool may_pass(const Model& model, const Contact& contact, double h, const std::vector<BodyVelocity>& v,
              double margin) {
  return contact.gap >= -level_of(margin) && !model.is_dynamic(contact.body_b) &&
         contact.gap + h * dot(contact.normal, relative_motion(contact, v).linear) < 0 &&
         is_solid(model.geom(contact.geom_a).shape) && is_solid(model.geom(contact.geom_b).shape);
}

}  // namespace

void Seams::start(const std::vector<Contact>& contacts) {
  by_body_.clear();
  known_ = contacts.size();
}

bool Seams::passes(const Model& model, const std::vector<Transform>& frames,
                   const std::vector<Contact>& contacts, const Contact& contact, double h,
                   const std::vector<BodyVelocity>& v, double margin) {
  if (!may_pass(model, contact, h, v, margin)) return false;
  if (by_body_.empty()) {
    by_body_.resize(known_);
    for (std::size_t i = 0; i < known_; ++i) by_body_[i] = i;
    std::stable_sort(by_body_.begin(), by_body_.end(),
                     [&](std::size_t i, std::size_t j) { return contacts[i].body_a < contacts[j].body_a; });
  }
  const Shape &a = model.geom(contact.geom_a).shape, &b = model.geom(contact.geom_b).shape;
  const double level = level_of(margin);
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
