#include "amontons/picture/picture.hpp"

#include "bindings.hpp"
#include "math_casters.hpp"

namespace amontons::python {

namespace {

using Triangles = nb::ndarray<const std::int32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void require_shape(const Matrix& a, std::size_t rows, std::size_t columns, const char* name) {
  AMONTONS_REQUIRE(a.shape(0) == rows && a.shape(1) == columns,
                   std::string("pictures: wrong shape of ") + name);
}

Vec3 vec3_of(const Matrix& a, std::size_t i) { return {a(i, 0), a(i, 1), a(i, 2)}; }
Transform transform_of(const Matrix& positions, const Matrix& rotations, std::size_t i) {
  return {vec3_of(positions, i), {rotations(i, 0), rotations(i, 1), rotations(i, 2), rotations(i, 3)}};
}

void add_surface(PictureScene& scene, const Matrix& vertices, const Triangles& triangles, bool flat,
                 bool closed, const IndexVector& bodies, const Matrix& positions, const Matrix& rotations,
                 const Matrix& scales, const Matrix& colours, double opacity, Appearance appearance) {
  const std::size_t count = bodies.shape(0);
  AMONTONS_REQUIRE(vertices.shape(1) == 3 && triangles.shape(1) == 3,
                   "pictures: triangles have three corners");
  require_shape(positions, count, 3, "positions");
  require_shape(rotations, count, 4, "rotations");
  require_shape(scales, count, 3, "scales");
  require_shape(colours, count, 3, "colours");
  PictureSurface surface;
  surface.flat = flat;
  surface.closed = closed;
  for (std::size_t v = 0; v < vertices.shape(0); ++v) surface.vertices.push_back(vec3_of(vertices, v));
  for (std::size_t t = 0; t < triangles.shape(0); ++t)
    surface.triangles.push_back({triangles(t, 0), triangles(t, 1), triangles(t, 2)});
  scene.surfaces.push_back(std::move(surface));
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 c = vec3_of(colours, i);
    scene.instances.push_back({static_cast<std::int32_t>(scene.surfaces.size() - 1),
                               bodies(i),
                               transform_of(positions, rotations, i),
                               vec3_of(scales, i),
                               {static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)},
                               static_cast<float>(opacity),
                               appearance});
  }
}

// (n, 10) rows: from, to, width, red, green, blue.
std::vector<PictureLine> lines_of(const Matrix& rows) {
  require_shape(rows, rows.shape(0), 10, "lines");
  std::vector<PictureLine> out;
  for (std::size_t i = 0; i < rows.shape(0); ++i)
    out.push_back(
        {vec3_of(rows, i),
         {rows(i, 3), rows(i, 4), rows(i, 5)},
         rows(i, 6),
         {static_cast<float>(rows(i, 7)), static_cast<float>(rows(i, 8)), static_cast<float>(rows(i, 9))}});
  return out;
}

nb::tuple draw(const PictureScene& scene, const Matrix& positions, const Matrix& orientations,
               const PictureCamera& camera, const PictureStyle& style, const Matrix& lines, bool probe,
               unsigned threads) {
  require_shape(positions, positions.shape(0), 3, "positions");
  require_shape(orientations, positions.shape(0), 4, "orientations");
  std::vector<Transform> bodies;
  for (std::size_t b = 0; b < positions.shape(0); ++b)
    bodies.push_back(transform_of(positions, orientations, b));
  const std::vector<PictureLine> drawn = lines_of(lines);
  const PictureView view{camera, style, drawn, probe, threads};
  Picture picture;
  {
    nb::gil_scoped_release release;
    picture = draw_picture(scene, bodies, view);
  }
  return nb::make_tuple(to_numpy(std::move(picture.colours)), to_numpy(std::move(picture.labels)),
                        to_numpy(std::move(picture.depths)));
}

}  // namespace

void bind_picture(nb::module_& m) {
  nb::enum_<Appearance>(m, "Appearance")
      .value("moving", Appearance::moving)
      .value("fixed", Appearance::fixed)
      .value("clear", Appearance::clear)
      .value("hidden", Appearance::hidden);
  nb::class_<PictureCamera>(m, "PictureCamera")
      .def(nb::init<>())
      .def_rw("right", &PictureCamera::right)
      .def_rw("up", &PictureCamera::up)
      .def_rw("eye", &PictureCamera::eye)
      .def_rw("target", &PictureCamera::target)
      .def_rw("distance", &PictureCamera::distance)
      .def_rw("pixel", &PictureCamera::pixel)
      .def_rw("width", &PictureCamera::width)
      .def_rw("height", &PictureCamera::height)
      .def_rw("samples", &PictureCamera::samples);
  nb::class_<PictureStyle>(m, "PictureStyle")
      .def(nb::init<>())
      .def_rw("light", &PictureStyle::light)
      .def_rw("ambient", &PictureStyle::ambient)
      .def_rw("glass", &PictureStyle::glass)
      .def_rw("fade", &PictureStyle::fade)
      .def_rw("tile", &PictureStyle::tile)
      .def_rw("floor", &PictureStyle::floor)
      .def_rw("background", &PictureStyle::background);
  nb::class_<PictureScene>(m, "PictureScene", "Surfaces, instances of them and planes.")
      .def(nb::init<>())
      .def("add", &add_surface, nb::arg("vertices"), nb::arg("triangles"), nb::arg("flat"), nb::arg("closed"),
           nb::arg("bodies"), nb::arg("positions"), nb::arg("rotations"), nb::arg("scales"),
           nb::arg("colours"), nb::arg("opacity"), nb::arg("appearance"), "A surface with its n instances.")
      .def(
          "add_plane",
          [](PictureScene& scene, std::int32_t body, const Vec3& position, const Quat& rotation) {
            scene.planes.push_back({body, {position, rotation}});
          },
          nb::arg("body"), nb::arg("position"), nb::arg("rotation"))
      .def("draw", &draw, nb::arg("positions"), nb::arg("orientations"), nb::arg("camera"), nb::arg("style"),
           nb::arg("lines"), nb::arg("probe"), nb::arg("threads"), nb::rv_policy::automatic,
           "Colours, and if probed the label and the depth of each sample; flat arrays.");
}

}  // namespace amontons::python
