#include <limits>

#include "check.hpp"
#include "collision_scenes.hpp"

// The shapes themselves: sizes, bounds, and convex hulls put together from triangles.
using namespace scenes;

namespace {
constexpr double infinity = std::numeric_limits<double>::infinity();
using Triangle = std::array<std::int32_t, 3>;

const std::vector<Vec3> tetrahedron{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<Triangle> its_faces{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
}  // namespace

// Fails if a size of any shape goes unchecked, or if the message does not name it.
TEST(sizes_must_be_positive_and_finite) {
  CHECK_THROWS(validate(Sphere{0}), "sphere: the radius");
  CHECK_THROWS(validate(Box{{1, -1, 1}}), "box: every half edge");
  CHECK_THROWS(validate(Capsule{1, NAN}), "capsule: the half length");
  CHECK_THROWS(validate(Cylinder{infinity, 1}), "cylinder: the radius");
  CHECK_THROWS(validate(Ellipsoid{{1, 1, 0}}), "ellipsoid: every semi-axis");
  CHECK_THROWS(validate(Hull{}), "make_hull()");
  CHECK_THROWS(validate(Mesh{}), "make_mesh()");
  CHECK_THROWS(validate(HeightField{}), "make_height_field()");
  for (const Shape& shape : {Shape{Sphere{1}}, Shape{Box{{1, 2, 3}}}, Shape{Plane{}}, Shape{prism(5, 1, 1)}})
    validate(shape);
}

TEST(coplanar_triangles_of_a_hull_are_one_face) {
  // 12 triangles, 6 faces: contact manifolds of a cube must have four corners, not three.
  const Hull box = box_hull({1, 2, 3});
  CHECK(box.data->faces.size() == 6 && box.data->vertices.size() == 8);
  for (std::size_t f = 0; f < 6; ++f) {
    CHECK(box.data->faces[f].size() == 4);
    CHECK_NEAR(norm(box.data->normals[f]), 1, 1e-15);
    for (std::int32_t i : box.data->faces[f])
      CHECK_NEAR(dot(box.data->normals[f], box.data->vertices[static_cast<std::size_t>(i)]),
                 box.data->offsets[f], 1e-15);
  }
  for (const auto& list : box.data->neighbours) CHECK(list.size() == 3);
  CHECK(prism(64, 1, 1).data->faces.size() == 66);
}

// Fails if corners that only triangulation made stay: they would come and go as contact points.
TEST(points_within_a_face_or_an_edge_are_no_corners) {
  // A cube whose top is a fan around its centre, and one top edge halved: neither point is a corner.
  std::vector<Vec3> v{{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1},
                      {1, -1, 1},   {1, 1, 1},   {-1, 1, 1}, {0, 0, 1},   {0, -1, 1}};
  const std::vector<Triangle> t{{0, 2, 1}, {0, 3, 2}, {4, 9, 8}, {9, 5, 8}, {5, 6, 8}, {6, 7, 8},
                                {7, 4, 8}, {0, 1, 9}, {1, 5, 9}, {0, 9, 4}, {1, 2, 6}, {1, 6, 5},
                                {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  CHECK(make_hull(v, t).data->vertices.size() == 8);
  CHECK(make_hull(v, t).data->faces.size() == 6);
  // Off the plane by what single precision leaves, it still is none.
  v[8].z += 1e-7;
  CHECK(make_hull(v, t).data->faces.size() == 6);
  // A real bump is one.
  v[8].z += 0.1;
  CHECK(make_hull(v, t).data->vertices.size() == 9);
}

// Fails if one of these becomes a hull whose faces are not those of its surface, or if
// the reason is another one.
TEST(bodies_that_are_no_hulls_are_refused_with_the_reason) {
  const auto hull = [](std::vector<Vec3> v, std::vector<Triangle> t) { return make_hull(v, t); };
  CHECK(hull(tetrahedron, its_faces).data->faces.size() == 4);
  CHECK_THROWS(hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}), "four corners, not 3");
  CHECK_THROWS(hull(tetrahedron, {{0, 2, 1}}), "four triangles");
  auto open = its_faces;
  open[3] = {1, 2, 4};
  auto five = tetrahedron;
  five.push_back({1, 1, 1});
  CHECK_THROWS(hull(five, open), "open at the edge");
  auto twice = its_faces;
  twice[3] = its_faces[0];
  CHECK_THROWS(hull(tetrahedron, twice), "same direction");
  auto inside_out = its_faces;
  for (Triangle& t : inside_out) std::swap(t[0], t[1]);
  CHECK_THROWS(hull(tetrahedron, inside_out), "face inwards");
  auto index = its_faces;
  index[0][0] = 4;
  CHECK_THROWS(hull(tetrahedron, index), "does not exist");
  auto repeated = its_faces;
  repeated[0][0] = 2;
  CHECK_THROWS(hull(tetrahedron, repeated), "twice");
  auto flat = tetrahedron;
  flat[3] = {0.3, 0.3, 0};
  CHECK_THROWS(hull(flat, its_faces), "flat");
  auto not_finite = tetrahedron;
  not_finite[1].y = NAN;
  CHECK_THROWS(hull(not_finite, its_faces), "vertex 1 is not finite");
  // A dent in the top of a cube.
  std::vector<Vec3> v{{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1},
                      {1, -1, 1},   {1, 1, 1},   {-1, 1, 1}, {0, 0, 0.5}};
  CHECK_THROWS(hull(v, {{0, 2, 1},
                        {0, 3, 2},
                        {4, 5, 8},
                        {5, 6, 8},
                        {6, 7, 8},
                        {7, 4, 8},
                        {0, 1, 5},
                        {0, 5, 4},
                        {1, 2, 6},
                        {1, 6, 5},
                        {2, 3, 7},
                        {2, 7, 6},
                        {3, 0, 4},
                        {3, 4, 7}}),
               "not convex");
}

// Fails if a tolerance of make_hull() is a length: 1e-6 m would flatten a small body, or join
// no faces of a large one.
TEST(hulls_do_not_depend_on_units) {
  for (double unit : {1e-6, 1.0, 1e6}) {
    std::vector<Vec3> v;
    for (const Vec3& p : tetrahedron) v.push_back(unit * p);
    CHECK(make_hull(v, its_faces).data->faces.size() == 4);
  }
}

TEST(bounds_enclose_the_shape_tightly) {
  // Against the support functions in the six directions: sqrt and products are all that rounds. Fails if a
  // box is too small, which loses pairs, or larger than need be, which costs time.
  const Quat q = turn({1, 2, 3}, 0.7);
  const Vec3 c{3, -2, 1};
  const Mat3 r = to_matrix(q);
  const auto check_box = [&](const Shape& shape, auto&& reach) {
    const Aabb box = bounds(shape, {c, q});
    for (int i = 0; i < 3; ++i) {
      CHECK_NEAR(box.upper[i], c[i] + reach(r.row[i]), 1e-14);
      CHECK_NEAR(box.lower[i], c[i] - reach(r.row[i]), 1e-14);
    }
  };
  check_box(Sphere{2}, [](Vec3) { return 2.0; });
  check_box(Box{{1, 2, 3}}, [](Vec3 d) { return std::abs(d.x) + 2 * std::abs(d.y) + 3 * std::abs(d.z); });
  check_box(box_hull({1, 2, 3}),
            [](Vec3 d) { return std::abs(d.x) + 2 * std::abs(d.y) + 3 * std::abs(d.z); });
  check_box(Capsule{0.5, 2}, [](Vec3 d) { return 0.5 + 2 * std::abs(d.z); });
  check_box(Cylinder{0.5, 2}, [](Vec3 d) { return 0.5 * std::hypot(d.x, d.y) + 2 * std::abs(d.z); });
  check_box(Ellipsoid{{1, 2, 3}}, [](Vec3 d) { return norm(Vec3{d.x, 2 * d.y, 3 * d.z}); });
  CHECK(bounds(Plane{}, {}).lower.x == -infinity && bounds(Plane{}, {}).upper.z == infinity);

  CHECK(bounding_radius(Sphere{2}) == 2);
  CHECK_NEAR(bounding_radius(Box{{1, 2, 2}}), 3, 1e-15);
  CHECK(bounding_radius(Capsule{1, 2}) == 3);
  CHECK_NEAR(bounding_radius(Cylinder{3, 4}), 5, 1e-15);
  CHECK(bounding_radius(Ellipsoid{{1, 5, 2}}) == 5);
  CHECK_NEAR(bounding_radius(box_hull({1, 2, 2})), 3, 1e-15);
  CHECK(bounding_radius(Plane{}) == infinity);
  CHECK(is_static_only(Plane{}) && !is_static_only(Sphere{1}));
}
