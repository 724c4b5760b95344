// Pictures by depth buffer: what is seen where, through glass, beside an eye, on planes, in shadow.
#include <algorithm>

#include "amontons/picture/picture.hpp"
#include "check.hpp"

using namespace amontons;

namespace {

PictureSurface square() {
  return {{{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}}, {{0, 1, 2}, {0, 2, 3}}, true, false};
}

PictureSurface box() {
  PictureSurface out;
  for (const int x : {-1, 1})
    for (const int y : {-1, 1})
      for (const int z : {-1, 1}) out.vertices.push_back({1.0 * x, 1.0 * y, 1.0 * z});
  const int faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                           {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  for (const auto& f : faces) {
    out.triangles.push_back({f[0], f[1], f[2]});
    out.triangles.push_back({f[0], f[2], f[3]});
  }
  return out;
}

// Seen along y, x to the right and z up, by 40 x 40 pixels of 0.1 m.
PictureCamera camera(int samples = 1) {
  PictureCamera c;
  c.pixel = 0.1;
  c.width = c.height = 40;
  c.samples = samples;
  return c;
}

PictureInstance at(const Vec3& position, Appearance appearance, const Colour& colour = {1, 0, 0}) {
  PictureInstance i;
  i.at.position = position;
  i.appearance = appearance;
  i.colour = colour;
  return i;
}

PictureStyle bright() {
  PictureStyle style;
  style.light = {0, -1, 0};
  return style;
}

Picture drawn(const PictureScene& scene, const PictureCamera& c, const PictureStyle& style = bright(),
              std::span<const PictureLine> lines = {}, unsigned threads = 1) {
  return draw_picture(scene, {}, {c, style, lines, true, threads});
}

int count(const Picture& p, std::int32_t label) {
  return static_cast<int>(std::count(p.labels.begin(), p.labels.end(), label));
}

std::array<int, 3> colour_at(const Picture& p, int column, int row_from_above) {
  const std::uint8_t* c = &p.colours[3 * (40 * row_from_above + column)];
  return {c[0], c[1], c[2]};
}

}  // namespace

// Breaks when a sample on a common edge belongs to no triangle, or one outside to any: a square of 2 m on
// pixels of 0.1 m has 400, shifted by a quarter of a pixel too.
TEST(every_sample_inside_is_seen_once) {
  for (const double shift : {0.0, 0.025, -0.043}) {
    PictureScene scene{{square()}, {at({shift, 0, shift}, Appearance::moving)}, {}};
    CHECK(count(drawn(scene, camera()), 0) == 400);
  }
}

// Breaks when what is behind covers what is in front, whatever is drawn first, or depths are not those of the
// surfaces.
TEST(the_nearer_covers_the_farther) {
  for (const bool first : {true, false}) {
    PictureInstance near = at({0, -1, 0}, Appearance::moving), far = at({0, 1, 0}, Appearance::moving);
    near.scale = {0.5, 1, 0.5};
    PictureScene scene{{square()}, {first ? near : far, first ? far : near}, {}};
    const Picture p = drawn(scene, camera());
    CHECK(count(p, first ? 0 : 1) == 100);
    CHECK(count(p, first ? 1 : 0) == 300);
    CHECK_NEAR(p.depths[40 * 20 + 20], 1, 1e-6);
    CHECK_NEAR(p.depths[40 * 12 + 12], -1, 1e-6);
  }
}

// Breaks when what is fixed hides what moves although it is of glass, shows it although it is not, or lets
// the empty room behind shine through.
TEST(what_moves_shines_through_what_is_fixed) {
  PictureInstance ball = at({0, 1, 0}, Appearance::moving, {1, 0, 0});
  ball.scale = {0.5, 1, 0.5};
  PictureScene scene{{square()}, {ball, at({0, -1, 0}, Appearance::fixed, {0, 0, 1})}, {}};
  PictureStyle style = bright();
  style.ambient = 0.9;
  const Picture glass = drawn(scene, camera(), style);
  CHECK(colour_at(glass, 20, 20)[0] > 180 && colour_at(glass, 20, 20)[2] > 60 &&
        colour_at(glass, 20, 20)[2] < 70);
  CHECK(colour_at(glass, 12, 12) == (std::array{0, 0, 255}));
  style.glass = 1;
  CHECK(colour_at(drawn(scene, camera(), style), 20, 20) == (std::array{0, 0, 255}));
  scene.instances[1].appearance = Appearance::hidden;
  CHECK(colour_at(drawn(scene, camera(), style), 12, 12) == (std::array{255, 255, 255}));
  scene.instances[1].appearance = Appearance::clear;  // by its own opacity, over everything
  scene.instances[1].opacity = 0.5f;
  CHECK_NEAR(colour_at(drawn(scene, camera(), style), 12, 12)[0], 128, 1);
}

// Breaks when an eye at a distance does not see twice as large what is half as far: at 4 m from the target
// the square at 2 m has 40 pixels of the 20 that it has at the target; and when what is behind the eye is
// drawn.
TEST(an_eye_at_a_distance) {
  PictureCamera c = camera();
  c.distance = 4;
  PictureInstance near = at({0, -2, 0}, Appearance::moving);
  near.scale = {0.5, 1, 0.5};
  CHECK(count(drawn({{square()}, {near}, {}}, c), 0) == 400);
  CHECK(count(drawn({{square()}, {at({0, 4, 0}, Appearance::moving)}, {}}, c), 0) == 100);
  CHECK(count(drawn({{square()}, {at({0, -5, 0}, Appearance::moving)}, {}}, c), 0) == 0);
  // A wall 1 m to the left, from 1 m before the target to behind the eye, is cut off and not left out. At u
  // to the left of the middle it is 2 u high, from 4/3 m to the edge at 2 m: 4 - 16/9 m2; half of the pixels
  // on its outline of 9 m may differ.
  PictureInstance wall = at({-1, -4, 0}, Appearance::moving);
  wall.at.rotation = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  wall.scale = {3, 1, 1};
  CHECK_NEAR(count(drawn({{square()}, {wall}, {}}, c), 0), 222, 45);
}

// Breaks when a plane is not where it is, is seen from below, or reaches above the horizon: an eye 1 m above
// it that looks along it sees it in the lower half of the picture.
TEST(planes) {
  PictureScene scene{{}, {}, {{-1, {{0, 0, -1}, {}}}}};
  PictureCamera c = camera();
  CHECK(count(drawn(scene, c), -2) == 0);  // parallel rays along it
  c.distance = 4;
  const Picture level = drawn(scene, c);
  CHECK(level.labels[40 * 25] == -1);
  // Rows from below: row r looks down by (19.5 - r) / 40 of the distance, down to the plane where that is 1
  // m.
  CHECK(level.labels[40 * 5 + 20] == -2);
  CHECK_NEAR(level.depths[40 * 5 + 20], 4 - 4 / 1.45, 1e-5);
  c.eye = {0, -std::sqrt(0.5), -std::sqrt(0.5)};
  c.up = {0, -std::sqrt(0.5), std::sqrt(0.5)};
  CHECK(count(drawn(scene, c), -2) == 0);
}

// Breaks when a box throws no shadow on the floor, throws one on itself, or one falls on what stands in the
// light.
TEST(shadows) {
  PictureInstance block = at({0, 0, 0.5}, Appearance::moving);
  block.scale = {0.5, 0.5, 0.5};
  PictureCamera c = camera();
  c.eye = {0, 0, 1};
  c.up = {0, 1, 0};
  PictureStyle style;
  style.light = normalised(Vec3{1, 0, 1});
  const Picture p = drawn({{box()}, {block}, {{-1, {}}}}, c, style);
  // Light from the right at 45 degrees: the block of 1 m throws a shadow of 1 m to the left, 10 pixels;
  // it takes 0.3 of the brightness of a plane.
  CHECK_NEAR(colour_at(p, 9, 20)[0], 0.7 * 255, 1);
  CHECK(colour_at(p, 3, 20)[0] == 255);
  CHECK(colour_at(p, 27, 20)[0] == 255);
  const int top = colour_at(p, 20, 20)[0];
  for (int column = 17; column < 24; ++column) CHECK(colour_at(p, column, 20)[0] == top);
}

// Breaks when tiles do not alternate along both axes of a plane, or do not fade away from the target.
TEST(tiles_of_a_plane) {
  PictureCamera c = camera();
  c.eye = {0, 0, 1};
  c.up = {0, 1, 0};
  PictureStyle style;
  style.tile = 0.5;  // 5 pixels; the middle of the picture is a corner of four tiles
  const Picture p = drawn({{}, {}, {{-1, {}}}}, c, style);
  const auto bright = [&](int column, int row) { return colour_at(p, column, row)[0]; };
  CHECK(bright(17, 22) == 255 && bright(22, 17) == 255);
  CHECK(bright(17, 17) < 230 && bright(22, 22) < 230);
  CHECK(bright(17, 37) > bright(12, 22) && bright(12, 22) > bright(22, 22));
}

// Breaks when a line is hidden, or not as wide as asked for.
TEST(lines_lie_over_everything) {
  const PictureLine line{{-2, 5, 0}, {2, 5, 0}, 0.4, {0, 1, 0}};
  const Picture p =
      drawn({{square()}, {at({}, Appearance::moving)}, {}}, camera(), bright(), std::span(&line, 1));
  int green = 0;
  for (int row = 0; row < 40; ++row) green += colour_at(p, 20, row) == (std::array{0, 255, 0});
  CHECK(green == 4);
}

// Breaks when the picture depends on how many threads draw it.
TEST(threads_draw_the_same) {
  PictureScene scene{{box()}, {}, {{-1, {{0, 0, -1}, {}}}}};
  for (int k = 0; k < 20; ++k) {
    PictureInstance block = at({0.3 * (k % 5) - 0.6, 0.4 * k, 0.2 * (k / 5)}, Appearance::moving);
    block.scale = {0.15, 0.1, 0.1};
    scene.instances.push_back(block);
  }
  PictureCamera c = camera(2);
  c.width = c.height = 200;
  c.pixel = 0.02;
  c.eye = normalised(Vec3{0, -1, 0.5});
  c.up = cross(c.eye, c.right);
  PictureStyle style;
  style.light = normalised(Vec3{0.4, -0.5, 1});
  CHECK(drawn(scene, c, style, {}, 1).colours == drawn(scene, c, style, {}, 4).colours);
}

// Breaks when what is not there is read: a body, a surface, a vertex, or a picture without pixels.
TEST(what_is_not_there_is_refused) {
  PictureCamera empty = camera();
  empty.width = 0;
  CHECK_THROWS(drawn({}, empty), "needs width");
  PictureScene scene{{square()}, {at({}, Appearance::moving)}, {}};
  scene.instances[0].body = 0;
  CHECK_THROWS(drawn(scene, camera()), "names a body");
  scene.instances[0] = at({}, Appearance::moving);
  scene.surfaces[0].triangles[1][2] = 9;
  CHECK_THROWS(drawn(scene, camera()), "names a vertex");
  CHECK_THROWS(drawn({{}, {}, {{3, {}}}}, camera()), "a plane");
}
