#include <filesystem>
#include <fstream>

#include "amontons.hpp"
#include "check.hpp"

// Models as Python writes them, through the same function. That every field arrives is
// tests/python/io/test_model_json.py.
using namespace amontons;

namespace {

// A ball on the floor.
const std::string good = R"({
  "shapes": [{"kind": "Plane"}, {"kind": "Sphere", "radius": 0.1},
             {"kind": "TriangleMesh", "vertices": "eJw=", "triangles": "eJw="}],
  "gravity": [0, 0, -1.6],
  "bodies": [{"name": "ball", "motion": "dynamic", "mass": 2, "inertia": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
              "pose": {"position": [0, 0, 0.5], "rotation": [1, 0, 0, 0]}}],
  "geoms": [{"name": "floor", "body": -1, "shape": 0, "mask": 4294967295},
            {"body": 0, "shape": 1, "material": {"friction": 0.3, "friction_across": null}}],
  "joints": [{"body_a": 0, "dofs": [{"kind": "slide", "name": "x", "upper": "Infinity", "lower": "-Infinity"}]}],
  "keyframes": [{"name": "home", "positions": [[0, 0, 1]]}], "unread": [],
  "sites": [{"name": "tip", "body": 0, "shape": 1}, {"name": "eye", "shape": null}],
  "visuals": [{"body": 0, "shape": 2, "colour": [1, 0, 0, 1]}, {"body": -1, "shape": 2}]
})";

// The text with one part of it replaced.
std::string broken(const std::string& part, const std::string& by) {
  std::string text = good;
  const std::size_t at = text.find(part);
  CHECK(at != std::string::npos);
  return text.replace(at, part.size(), by);
}

}  // namespace

// Fails if a field goes elsewhere, an infinity is a number, or what no step reads is lost.
TEST(model_from_json) {
  const ModelDescription d = read_model_json(good);
  CHECK(d.gravity == Vec3(0, 0, -1.6) && d.bodies.size() == 1 && d.geoms.size() == 2);
  CHECK(d.bodies[0].mass == 2 && d.bodies[0].pose.position == Vec3(0, 0, 0.5));
  CHECK(d.geoms[0].mask == 4294967295u && d.geoms[0].body == world);
  CHECK(std::get<Sphere>(d.geoms[1].shape).radius == 0.1);
  CHECK(d.geoms[1].material.friction == 0.3 && d.geoms[1].material.friction_across < 0);
  CHECK(d.joints[0].dofs[0].upper == infinity && d.joints[0].dofs[0].lower == -infinity);
  CHECK(d.joints[0].dofs[0].name == "x" && d.keyframes[0].positions[0] == Vec3(0, 0, 1));
  CHECK(std::get<Sphere>(*d.sites[0].shape.shape).radius == 0.1 && !d.sites[1].shape.shape);
  CHECK(d.visuals[0].shape.mesh->vertices == "eJw=" && d.visuals[0].shape.mesh == d.visuals[1].shape.mesh);
  const Model model(d);
  CHECK(model.body_index("ball") == 0);
}

// Fails if what is written is not what was read, an infinity is a number, or a later version is read.
TEST(model_to_json) {
  const ModelDescription d = read_model_json(good);
  const std::string text = write_model_json(d);
  CHECK(write_model_json(read_model_json(text)) == text);
  CHECK(text.find("\"-Infinity\"") != std::string::npos &&
        text.find("\"friction_across\":null") != std::string::npos);
  CHECK(text.find("\"version\":2") != std::string::npos);
  CHECK_THROWS(read_model_json(broken("\"shapes\"", "\"version\": 3, \"shapes\""), "m.json"),
               "m.json: version: it is 3; this version of amontons reads 2");
  CHECK_THROWS(write_model_file(d, "no/such/folder/m.json"), "cannot be written");
  // A name that cannot be replaced stays, and nothing is left beside it.
  const auto taken = std::filesystem::temp_directory_path() / "amontons_taken.json";
  std::filesystem::create_directory(taken);
  CHECK_THROWS(write_model_file(d, taken), "cannot be written");
  CHECK(std::filesystem::is_directory(taken) && !std::filesystem::exists(taken.string() + ".part"));
  std::filesystem::remove(taken);
}

// Fails if a file of the first version is refused for a name that changed, or loses its value.
TEST(json_of_the_first_version) {
  CHECK(read_model_json(broken("dynamic", "fixed"), "m.json").bodies[0].motion == Motion::still);
  const std::string play = R"("play": 0.001, "play_length": 0.1, "play_friction": 0.2, "dofs")";
  const Joint joint = read_model_json(broken("\"dofs\"", play), "m.json").joints[0];
  CHECK(joint.clearance == 0.001 && joint.guide_length == 0.1 && joint.clearance_friction == 0.2);
}

// Fails if a broken file is read, or the message does not say where it is broken.
TEST(json_that_is_broken) {
  const auto read = [](const std::string& text) { read_model_json(text, "m.json"); };
  CHECK_THROWS(read(""), "m.json: no JSON: parse error at line 1, column 1");
  CHECK_THROWS(read(broken("[0, 0, -1.6]", "[0, 0, ]")), "m.json: no JSON: parse error at line 4, column 21");
  CHECK_THROWS(read("[1]"), "m.json: no model: there is no list \"shapes\"");
  CHECK_THROWS(read(R"({"bodies": []})"), "amontons.write_model");
  CHECK_THROWS(read(broken("\"mass\": 2", "\"mass\": \"2\"")), "m.json: bodies[0].mass: give a number");
  CHECK_THROWS(read(broken("[0, 0, 0.5]", "[0, 0]")), "m.json: bodies[0].pose.position: give 3 entries");
  CHECK_THROWS(read(broken("[0, 0, 0.5]", "[0, 0, null]")), "bodies[0].pose.position[2]: give a number");
  CHECK_THROWS(read(broken("dynamic", "flying")), "bodies[0].motion: give one of dynamic, kinematic, static");
  CHECK_THROWS(read(broken("\"shape\": 1", "\"shape\": 7")), "geoms[1].shape: there is no such shape");
  CHECK_THROWS(read(broken("\"shape\": 1", "\"shape\": 2")), "geoms[1].shape: there is no such shape");
  CHECK_THROWS(read(broken("\"shape\": 1, ", "")), "geoms[1]: there is no \"shape\"");
  CHECK_THROWS(read(broken("4294967295", "4294967296")), "geoms[0].mask: give an integer of 32 bits");
  CHECK_THROWS(read(broken("4294967295", "-1")), "geoms[0].mask: give an integer");
  CHECK_THROWS(read(broken("\"body\": -1", "\"body\": 0.5")), "geoms[0].body: give an integer");
  CHECK_THROWS(read(broken("0.3", "\"NaN\"")), "geoms[1].material.friction: give a number");
  CHECK_THROWS(read(broken("\"upper\"", "\"uper\"")), "joints[0].dofs[0]: \"uper\" is not known here");
  CHECK_THROWS(read(broken("\"radius\": 0.1", "\"radius\": []")), "shapes[1].radius: give a number");
  CHECK_THROWS(read(broken("\"radius\": 0.1", "\"r\": 1")), "shapes[1]: there is no \"radius\"");
  CHECK_THROWS(read(broken("\"Sphere\"", "\"Torus\"")), "shapes[1]: the kind of shape is not known");
  CHECK_THROWS(
      read(broken(R"("Sphere", "radius": 0.1)", R"("Hull", "vertices": [[0, 0, 0]], "triangles": [])")),
      "shapes[1]: ");
  CHECK_THROWS(read(std::string(100000, '[')), "no JSON");
}

// Fails if the name of the file is lost, by what reads it or by what checks the model.
TEST(model_files_are_named) {
  const std::string path = "test_model_json.json";
  CHECK_THROWS(Model::from_json("nothing.json"), "nothing.json: no such file");
  CHECK_THROWS(Model::from_json("."), ".: no such file");
  std::ofstream(path) << broken("\"mass\": 2", "\"mass\": -2");
  CHECK_THROWS(Model::from_json(path), path + ": body \"ball\": the mass is -2");
  std::ofstream(path) << broken("\"mass\": 2", "\"mass\": ");
  CHECK_THROWS(Model::from_json(path), path + ": no JSON: parse error at line 5");
  std::ofstream(path) << good;
  CHECK(Model::from_json(path).total_mass() == 2);
  std::remove(path.c_str());
}
