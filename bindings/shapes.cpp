#include "amontons/collision/shapes/shapes.hpp"

#include <cmath>

#include "amontons/collision/broad_phase.hpp"
#include "amontons/collision/pairs/collide.hpp"
#include "amontons/collision/rays/ray.hpp"
#include "bindings.hpp"
#include "math_casters.hpp"

namespace amontons::python {

namespace {

using Triangles = nb::ndarray<const std::int32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

static_assert(sizeof(Vec3) == 3 * sizeof(double), "points and Vec3 share their layout");

std::span<const Vec3> points_of(const Matrix& a) {
  AMONTONS_REQUIRE(a.shape(1) == 3, "points must have three coordinates");
  return {reinterpret_cast<const Vec3*>(a.data()), a.shape(0)};
}

std::span<const std::array<std::int32_t, 3>> triangles_of(const Triangles& a) {
  AMONTONS_REQUIRE(a.shape(1) == 3, "triangles must have three corners");
  return {reinterpret_cast<const std::array<std::int32_t, 3>*>(a.data()), a.shape(0)};
}

Shape shape_of(const std::string& kind, const nb::dict& values) {
  std::optional<Shape> made;
  detail::any_shape([&]<class S>() {
    if constexpr (detail::Described<S>) {
      if (kind != detail::shape_name<S>) return false;
      S shape{};
      const auto take = [&]<class Value>(const detail::Field<S, Value>& field) {
        shape.*field.member = nb::cast<Value>(values[field.name]);
      };
      std::apply([&](const auto&... field) { (take(field), ...); }, detail::fields<S>);
      made = shape;
      return true;
    }
    return false;
  });
  AMONTONS_REQUIRE(made, "there is no shape " + kind + " of a few lengths");
  validate(*made);
  return *made;
}

std::string kind_of(const Shape& shape) {
  return std::visit([]<class S>(const S&) { return std::string(detail::shape_name<S>); }, shape);
}

const void* data_of(const Shape& shape) {
  return std::visit(
      [](const auto& s) -> const void* {
        if constexpr (requires { s.data; }) return s.data.get();
        return nullptr;
      },
      shape);
}
std::uintptr_t key_of(const Shape& shape) { return reinterpret_cast<std::uintptr_t>(data_of(shape)); }

// Arrays are copies.
nb::dict triangles_to_dict(std::span<const Vec3> vertices,
                           std::span<const std::array<std::int32_t, 3>> triangles) {
  const auto* points = reinterpret_cast<const double*>(vertices.data());
  const auto* corners = triangles.data()->data();
  nb::dict out;
  out["vertices"] = to_numpy(std::vector(points, points + 3 * vertices.size()), 3);
  out["triangles"] = to_numpy(std::vector(corners, corners + 3 * triangles.size()), 3);
  return out;
}
nb::dict values_of_shape(const Shape& shape) {
  if (const auto* hull = std::get_if<Hull>(&shape))
    return triangles_to_dict(hull->data->given_vertices, hull->data->given_triangles);
  if (const auto* mesh = std::get_if<Mesh>(&shape))
    return triangles_to_dict(vertices_of(*mesh), triangles_of(*mesh));
  nb::dict out;
  if (const auto* field = std::get_if<HeightField>(&shape)) {
    const Heights heights = heights_of(*field);
    out["heights"] = to_numpy(std::vector(heights.values.begin(), heights.values.end()), heights.columns);
    out["size_x"] = heights.size_x;
    out["size_y"] = heights.size_y;
    return out;
  }
  const auto fill = [&]<class S>(const S& s) {
    if constexpr (detail::Described<S>)
      std::apply([&](const auto&... field) { ((out[field.name] = nb::cast(s.*field.member)), ...); },
                 detail::fields<S>);
  };
  std::visit(fill, shape);
  return out;
}

// (mass, centre, inertia)
using Solid = std::tuple<double, Vec3, Mat3>;
Solid to_tuple(const MassProperties& s) { return {s.mass, s.centre_of_mass, s.inertia}; }
MassProperties to_solid(const Solid& s) { return {std::get<0>(s), std::get<1>(s), std::get<2>(s)}; }

OutMatrix contact_points(const Shape& a, const Vec3& position_a, const Quat& orientation_a, const Shape& b,
                         const Vec3& position_b, const Quat& orientation_b, double margin) {
  std::vector<ContactPoint> points;
  collide(a, {position_a, orientation_a}, b, {position_b, orientation_b}, margin, points);
  std::vector<double> out;
  for (const ContactPoint& p : points)
    out.insert(out.end(), {p.point.x, p.point.y, p.point.z, p.normal.x, p.normal.y, p.normal.z, p.gap});
  return to_numpy(std::move(out), 7);
}

nb::ndarray<nb::numpy, std::int32_t, nb::ndim<2>> pairs_of_boxes(const Matrix& lower, const Matrix& upper,
                                                                 const Flags& fixed, const Vector& radii,
                                                                 const Matrix& moves,
                                                                 const PairSearch* outside) {
  const auto lo = points_of(lower), hi = points_of(upper), travels = points_of(moves);
  AMONTONS_REQUIRE(lo.size() == hi.size() && lo.size() == fixed.shape(0) && lo.size() == radii.shape(0) &&
                       lo.size() == travels.size(),
                   "broad_phase: the arrays differ in length");
  std::vector<Aabb> boxes;
  std::vector<Ball> balls;
  for (std::size_t i = 0; i < lo.size(); ++i) {
    balls.push_back({0.5 * lo[i] + 0.5 * hi[i], radii.data()[i]});
    boxes.push_back(std::isfinite(balls[i].radius) ? box_around(balls[i], travels[i]) : Aabb{lo[i], hi[i]});
  }
  std::vector<IndexPair> pairs;
  const std::vector<unsigned char> still(fixed.data(), fixed.data() + fixed.shape(0));
  BroadPhase().find_pairs({boxes, balls, travels, still}, pairs, outside);
  std::vector<std::int32_t> out;
  for (const auto& [i, j] : pairs) out.insert(out.end(), {i, j});
  return to_numpy(std::move(out), 2);
}

}  // namespace

void bind_shapes(nb::module_& m) {
  nb::class_<Shape>(m, "Shape", "A collision shape; checked when it is made.")
      .def_static("of", &shape_of, nb::arg("kind"), nb::arg("values"), "A shape of a few lengths, by name.")
      .def_static(
          "hull",
          [](Matrix vertices, Triangles triangles) {
            return Shape(make_hull(points_of(vertices), triangles_of(triangles)));
          },
          nb::arg("vertices"), nb::arg("triangles"))
      .def_static(
          "mesh",
          [](Matrix vertices, Triangles triangles) {
            return Shape(make_mesh(points_of(vertices), triangles_of(triangles)));
          },
          nb::arg("vertices"), nb::arg("triangles"))
      .def_static(
          "height_field",
          [](Matrix heights, double size_x, double size_y) {
            return Shape(make_height_field({heights.data(), heights.size()}, heights.shape(0),
                                           heights.shape(1), size_x, size_y));
          },
          nb::arg("heights"), nb::arg("size_x"), nb::arg("size_y"))
      .def_prop_ro("kind", &kind_of)
      .def_prop_ro("values", &values_of_shape, "What it was made of, by name.")
      .def_prop_ro("key", &key_of, "Equal for shapes that share their data; 0 for one of a few lengths.")
      .def(
          "mass_properties",
          [](const Shape& shape, double density) { return to_tuple(mass_properties(shape, density)); },
          nb::arg("density"), "Mass, centre, inertia about the centre.")
      .def(
          "cast_ray",
          [](const Shape& shape, const Vec3& origin, const Vec3& direction) {
            const RayHit hit = cast_ray(shape, {origin, direction});
            return std::make_pair(hit.distance, hit.normal);
          },
          nb::arg("origin"), nb::arg("direction"), "Distance, normal; in the frame of the shape.")
      .def(
          "bounds",
          [](const Shape& shape, const Vec3& position, const Quat& orientation) {
            const Aabb box = bounds(shape, {position, orientation});
            return std::make_pair(box.lower, box.upper);
          },
          nb::arg("position"), nb::arg("orientation"), "Corners of the box around it, world axes.");
  m.def(
      "moved_solid",
      [](const Solid& solid, const Transform& frame) { return to_tuple(moved(to_solid(solid), frame)); },
      nb::arg("solid"), nb::arg("frame"), "(mass, centre, inertia) seen from the parent of the frame.");
  m.def(
      "sum_of_solids", [](const Solid& a, const Solid& b) { return to_tuple(to_solid(a) + to_solid(b)); },
      nb::arg("a"), nb::arg("b"), "(mass, centre, inertia) of both as one.");
  m.def("collide", &contact_points, nb::arg("shape_a"), nb::arg("position_a"), nb::arg("orientation_a"),
        nb::arg("shape_b"), nb::arg("position_b"), nb::arg("orientation_b"), nb::arg("margin"),
        nb::rv_policy::automatic, "(n, 7): point, normal from B to A, gap.");
  m.def("broad_phase", &pairs_of_boxes, nb::arg("lower"), nb::arg("upper"), nb::arg("fixed"),
        nb::arg("radii"), nb::arg("travels"), nb::arg("outside").none() = nb::none(),
        nb::rv_policy::automatic,
        "(k, 2): the pairs of boxes that overlap, with balls in their middles that may touch. A ball with a "
        "bound has the box of its travel.");
}

}  // namespace amontons::python
