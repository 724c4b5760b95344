#include "amontons/multibody/model/model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "amontons/multibody/model/model_json.hpp"

namespace amontons {

namespace {

// Pairs have no order, so keys are stored smaller index first. The world is -1 and comes first.
std::pair<Index, Index> ordered(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

// The upper median of the bounding radii of geoms on dynamic bodies; 1 without any. A median is not affected
// by one large hull or many small wheels. The ground does not count, because it may have any size.
double median_radius(const Model& model) {
  std::vector<double> radii;
  for (const Geom& geom : model.description().geoms)
    if (model.is_dynamic(geom.body)) radii.push_back(bounding_radius(geom.shape));
  if (radii.empty()) return 1;
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  return *middle;
}

// The geometric mean is the default: it is zero if one surface has no friction, and otherwise between the
// two. No rule follows from physics: friction is a property of pairs, which pair materials describe.
double combined(FrictionRule rule, double a, double b) {
  switch (rule) {
    case FrictionRule::geometric_mean:
      return std::sqrt(a * b);
    case FrictionRule::maximum:
      return std::max(a, b);
    case FrictionRule::minimum:
      return std::min(a, b);
    case FrictionRule::mean:
      break;
  }
  return 0.5 * (a + b);
}

// Mass of each dynamic body over that of the heaviest body of its mechanism, the dynamic bodies that joints
// connect (union-find). 1 for bodies without joints.
std::vector<double> lightness_in_mechanism(const ModelDescription& d) {
  std::vector<std::size_t> parent(d.bodies.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto moves = [&](Index body) { return body >= 0 && d.bodies[body].motion == Motion::dynamic; };
  for (const Joint& joint : d.joints)
    if (moves(joint.body_a) && moves(joint.body_b))
      parent[root(static_cast<std::size_t>(joint.body_a))] = root(static_cast<std::size_t>(joint.body_b));
  std::vector<double> heaviest(d.bodies.size(), 0.0), lightness(d.bodies.size(), 1.0);
  for (std::size_t i = 0; i < d.bodies.size(); ++i)
    if (moves(static_cast<Index>(i))) heaviest[root(i)] = std::max(heaviest[root(i)], d.bodies[i].mass);
  for (std::size_t i = 0; i < d.bodies.size(); ++i)
    if (moves(static_cast<Index>(i))) lightness[i] = d.bodies[i].mass / heaviest[root(i)];
  return lightness;
}

std::vector<Mat3> inverse_inertias(const std::vector<Body>& bodies) {
  std::vector<Mat3> all;
  for (const Body& body : bodies)
    all.push_back(body.motion == Motion::dynamic ? inverse(body.inertia) : Mat3{});
  return all;
}

Model::Outline outline_of(const Model& model, const Geom& geom) {
  const auto is = [&]<class... S>() { return (std::holds_alternative<S>(geom.shape) || ...); };
  const bool is_ball = is.operator()<Sphere>() && geom.body >= 0 && geom.frame.position == Vec3{} &&
                       model.body(geom.body).centre_of_mass == Vec3{};
  return {.body = geom.body,
          .category = geom.category,
          .mask = geom.mask,
          .dynamic = model.is_dynamic(geom.body),
          .still = geom.body < 0 || model.body(geom.body).motion == Motion::still,
          .round = is.operator()<Sphere, Capsule, Ellipsoid>(),
          .plane = is.operator()<Plane>(),
          .has_corners = is.operator()<Hull, Mesh, HeightField>(),
          .conveys = !(geom.surface_velocity == Vec3{} && geom.surface_spin == Vec3{}),
          .radius = is_ball ? std::get<Sphere>(geom.shape).radius : 0};
}

}  // namespace

Model::Model(ModelDescription description) : d_(std::move(description)) {
  check(d_);
  // Data derived from the description, once: sums, the scale, the first dof of each joint, sorted pairs.
  for (const Body& body : d_.bodies) {
    dynamic_.push_back(body.motion == Motion::dynamic);
    if (dynamic_.back()) total_mass_ += body.mass;
  }
  inverse_inertia_ = inverse_inertias(d_.bodies);
  weigh_mechanisms();
  length_ = median_radius(*this);
  first_dof_.push_back(0);
  for (const Joint& joint : d_.joints) {
    first_dof_.push_back(first_dof_.back() + joint.dofs.size());
    // A joint to the world does not exclude contacts with the rest of the world.
    if (!joint.collide && joint.body_b != world) excluded_.push_back(ordered(joint.body_a, joint.body_b));
  }
  dof_actuators_.resize(dofs());
  for (const Joint& joint : d_.joints)
    for (const Dof& dof : joint.dofs)
      bounds_efforts_ |= dof.lower_effort > -infinity || dof.upper_effort < infinity;
  tendon_actuators_.resize(d_.tendons.size());
  for (std::size_t k = 0; k < d_.actuators.size(); ++k) {
    const Transmission& t = d_.actuators[k].transmission;
    std::vector<Index>& list = t.kind == Transmission::Kind::dof ? dof_actuators_[first_dof(t.joint) + t.dof]
                               : t.kind == Transmission::Kind::tendon ? tendon_actuators_[t.tendon]
                                                                      : other_actuators_;
    list.push_back(static_cast<Index>(k));
  }
  list_controls();
  for (const auto& [a, b] : d_.excluded_bodies) excluded_.push_back(ordered(a, b));
  std::sort(excluded_.begin(), excluded_.end());
  for (const auto& [a, b] : d_.excluded_geoms) excluded_geoms_.push_back(ordered(a, b));
  std::sort(excluded_geoms_.begin(), excluded_geoms_.end());
  for (const PairMaterial& p : d_.pair_materials) pairs_.push_back({ordered(p.geom_a, p.geom_b), p.material});
  for (const PairMaterial& p : d_.pair_materials)
    if (p.always) always_.push_back(ordered(p.geom_a, p.geom_b));
  std::sort(always_.begin(), always_.end());
  for (const Geom& geom : d_.geoms) {
    outlines_.push_back(outline_of(*this, geom));
    has_corners_ |= outlines_.back().has_corners;
    rest_offset_.push_back(geom.material.rest_offset);
  }
  for (const PairMaterial& p : d_.pair_materials)
    for (Index g : {p.geom_a, p.geom_b}) rest_offset_[g] = std::max(rest_offset_[g], p.material.rest_offset);
  // If a pair has two materials the later one counts.
  std::stable_sort(pairs_.begin(), pairs_.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  list_pairs();
}

void Model::list_pairs() {
  if (!lists_pairs()) return;
  const auto geoms = static_cast<Index>(d_.geoms.size());
  for (Index a = 0; a < geoms; ++a)
    for (Index b = a + 1; b < geoms; ++b)
      if (may_touch(a, b)) listed_pairs_.emplace_back(a, b);
}

void Model::weigh_mechanisms() {
  // Mass (relative to the heaviest body of the mechanism): floor, see Model::mobility_factor().
  constexpr double least_lightness = 1e-8;
  lightness_ = lightness_in_mechanism(d_);
  for (double& lightness : lightness_) {
    mobility_factor_.push_back(std::min(1.0, lightness / least_lightness));
    lightness = std::max(lightness, least_lightness);
  }
}

// Actuators come first, so that controls of MJCF keep their order.
void Model::list_controls() {
  for (std::size_t k = 0; k < d_.actuators.size(); ++k)
    controls_.push_back({d_.actuators[k].name, static_cast<Index>(k)});
  const auto is_actuator = [&](const std::string& name) {
    return std::any_of(d_.actuators.begin(), d_.actuators.end(),
                       [&](const auto& a) { return a.name == name; });
  };
  for (std::size_t j = 0; j < d_.joints.size(); ++j)
    for (std::size_t k = 0; k < d_.joints[j].dofs.size(); ++k) {
      const Joint& joint = d_.joints[j];
      const bool has_motor = joint.dofs[k].motor.kind != MotorKind::none;
      dof_control_.push_back(has_motor ? static_cast<Index>(controls_.size()) : -1);
      if (!has_motor) continue;
      std::string name = joint.name;
      if (joint.dofs.size() > 1 || joint.spherical) name += "[" + std::to_string(k) + "]";
      if (is_actuator(name)) name += " motor";
      controls_.push_back({std::move(name), -1, static_cast<Index>(j), static_cast<Index>(k)});
    }
}

void Model::to_json(const std::filesystem::path& file) const { write_model_file(d_, file); }

Model Model::from_json(const std::filesystem::path& file) {
  try {
    return Model(read_model_file(file));
  } catch (const InputError& error) {  // thrown by the check, which does not know the file
    if (std::string_view(error.what()).starts_with(file.string())) throw;
    throw InputError(file.string() + ": " + error.what());
  }
}

std::size_t Model::dof_index(Reference joint, Index dof) const {
  const Index j = joint_index(joint);
  const std::size_t count = d_.joints[j].dofs.size();
  AMONTONS_REQUIRE(dof >= 0 && static_cast<std::size_t>(dof) < count,
                   "joint \"" + d_.joints[j].name + "\" has " + std::to_string(count) +
                       " degrees of freedom; dof = " + std::to_string(dof) + " is none of them");
  return first_dof_[j] + static_cast<std::size_t>(dof);
}

double Model::lightness(Index body_a, Index body_b) const {
  const bool a = is_dynamic(body_a), b = is_dynamic(body_b);
  if (!a && !b) return 1;
  if (!b || (a && body(body_a).mass < body(body_b).mass)) return lightness_[body_a];
  return lightness_[body_b];
}

// Called for every pair of the broad phase in every step: masks first, which decide most cases, then a
// search, where there is anything to find.
bool Model::may_touch(Index geom_a, Index geom_b) const {
  const Outline &a = outlines_[geom_a], &b = outlines_[geom_b];
  if (a.body == b.body || (!a.dynamic && !b.dynamic)) return false;
  if (!always_.empty() && std::binary_search(always_.begin(), always_.end(), ordered(geom_a, geom_b)))
    return true;
  if (!((a.category & b.mask) || (b.category & a.mask))) return false;
  if (!excluded_.empty() && std::binary_search(excluded_.begin(), excluded_.end(), ordered(a.body, b.body)))
    return false;
  return excluded_geoms_.empty() ||
         !std::binary_search(excluded_geoms_.begin(), excluded_geoms_.end(), ordered(geom_a, geom_b));
}

// A pair's own material, otherwise the combination of the two. Restitution and moments take the larger value,
// compliances and rest offsets add, see FrictionRule. friction_across comes from the geom that has one,
// combined with the plain coefficient of the other.
Material Model::material(Index geom_a, Index geom_b) const {
  const auto key = ordered(geom_a, geom_b);
  // The last entry with the key counts if a pair occurs twice.
  const auto after = std::upper_bound(pairs_.begin(), pairs_.end(), key,
                                      [](const auto& k, const auto& pair) { return k < pair.first; });
  if (after != pairs_.begin() && std::prev(after)->first == key) return std::prev(after)->second;
  const Material &a = d_.geoms[geom_a].material, &b = d_.geoms[geom_b].material;
  Material m;
  m.friction = combined(d_.friction_rule, a.friction, b.friction);
  if (a.friction_across >= 0 || b.friction_across >= 0)
    m.friction_across = combined(d_.friction_rule, a.friction_across >= 0 ? a.friction_across : a.friction,
                                 b.friction_across >= 0 ? b.friction_across : b.friction);
  // A surface without a static coefficient brings its kinetic one.
  const auto stuck = [](const Material& s) {
    return s.friction_static >= 0 ? s.friction_static : s.friction;
  };
  if (a.friction_static >= 0 || b.friction_static >= 0)
    m.friction_static = combined(d_.friction_rule, stuck(a), stuck(b));
  m.stribeck_speed = std::max(a.stribeck_speed, b.stribeck_speed);
  m.torsional_friction = std::max(a.torsional_friction, b.torsional_friction);
  m.rolling_friction = std::max(a.rolling_friction, b.rolling_friction);
  m.restitution = std::max(a.restitution, b.restitution);
  m.compliance = a.compliance + b.compliance;
  if (m.compliance > 0)
    m.relaxation_time = (a.compliance * a.relaxation_time + b.compliance * b.relaxation_time) / m.compliance;
  m.rest_offset = a.rest_offset + b.rest_offset;
  return m;
}

}  // namespace amontons
