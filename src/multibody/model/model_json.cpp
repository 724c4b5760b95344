#include "amontons/multibody/model/model_json.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>

#include "amontons/base/error.hpp"
#include "amontons/multibody/model/description.hpp"

namespace amontons {
namespace {

using Json = nlohmann::json;
using detail::fields, detail::values_of, detail::Described;
using Triangle = std::array<std::int32_t, 3>;

// The kind of a shape that is for pictures alone.
constexpr auto picture_mesh = "TriangleMesh";

// A value of the file with its path, which is formatted only for a message.
struct Place {
  const Json& value;
  const Place* parent = nullptr;
  const char* key = nullptr;  // in an object; otherwise the index in a list
  std::size_t index = 0;

  std::string path() const {
    if (!parent) return "";
    const std::string before = parent->path();
    if (!key) return before + "[" + std::to_string(index) + "]";
    return before + (before.empty() ? "" : ".") + key;
  }
  [[noreturn]] void fail(const std::string& what) const {
    const std::string where = path();
    throw InputError((where.empty() ? "" : where + ": ") + what);
  }
  Place entry(std::size_t i) const { return {value[i], this, nullptr, i}; }
  Place field(const char* name) const { return {value.at(name), this, name}; }
  // Requires a list, of a given length if `size` is set.
  void require_list(std::size_t size) const {
    if (!value.is_array() || value.size() != size) fail("give " + std::to_string(size) + " entries");
  }
};

// Keys of a model that are no fields of it.
template <class T>
constexpr std::array<const char*, 0> passed_over{};
template <>
constexpr std::array<const char*, 2> passed_over<ModelDescription>{"version", "shapes"};

// Names of the first version, and what they became in the second.
constexpr std::pair<std::string_view, std::string_view> renamed[] = {{"play", "clearance"},
                                                                     {"play_length", "guide_length"},
                                                                     {"play_friction", "clearance_friction"},
                                                                     {"fixed", "static"}};

std::string present_name(const std::string& name) {
  for (const auto& [former, present] : renamed)
    if (name == former) return std::string(present);
  return name;
}

class Reader {
 public:
  explicit Reader(const Place& file) {
    // The version comes first: a later one may have no such lists.
    if (file.value.is_object() && file.value.contains("version")) {
      int version = 0;
      read(file.field("version"), version);
      if (version > model_json_version)
        file.field("version").fail("it is " + std::to_string(version) + "; this version of amontons reads " +
                                   std::to_string(model_json_version) + ": take a newer one");
    }
    for (const char* key : {"shapes", "bodies", "geoms"})
      if (!file.value.is_object() || !file.value.contains(key) || !file.value[key].is_array())
        file.fail(std::string("no model: there is no list \"") + key +
                  "\"; write it by amontons.write_model");
    const Place list = file.field("shapes");
    for (std::size_t i = 0; i < list.value.size(); ++i) shapes_.push_back(shape_of(list.entry(i)));
  }

  void read(const Place& p, double& x) const {
    if (p.value.is_number())
      x = p.value.get<double>();
    else if (p.value == "Infinity" || p.value == "-Infinity")
      x = p.value == "Infinity" ? infinity : -infinity;
    else
      p.fail("give a number");
  }
  void read(const Place& p, bool& x) const {
    if (!p.value.is_boolean()) p.fail("give true or false");
    x = p.value.get<bool>();
  }
  void read(const Place& p, std::string& x) const {
    if (!p.value.is_string()) p.fail("give a text");
    x = p.value.get<std::string>();
  }
  template <std::integral T>
  void read(const Place& p, T& x) const {
    // The parser turns an integer beyond 64 bits into a float, which is rejected too.
    const bool in_range = p.value.is_number_unsigned()
                              ? p.value.get<std::uint64_t>() <= std::uint64_t{std::numeric_limits<T>::max()}
                          : p.value.is_number_integer()
                              ? p.value.get<std::int64_t>() >= std::int64_t{std::numeric_limits<T>::min()}
                              : false;
    if (!in_range) p.fail("give an integer of 32 bits");
    x = p.value.get<T>();
  }
  void read(const Place& p, Vec3& x) const {
    p.require_list(3);
    for (int i = 0; i < 3; ++i) read(p.entry(i), x[i]);
  }
  void read(const Place& p, Quat& x) const {
    p.require_list(4);
    std::size_t i = 0;
    for (double* part : {&x.w, &x.x, &x.y, &x.z}) read(p.entry(i++), *part);
  }
  void read(const Place& p, Mat3& x) const {
    p.require_list(3);
    for (int i = 0; i < 3; ++i) read(p.entry(i), x.row[i]);
  }
  template <class T, std::size_t n>
  void read(const Place& p, std::array<T, n>& x) const {
    p.require_list(n);
    for (std::size_t i = 0; i < n; ++i) read(p.entry(i), x[i]);
  }
  void read(const Place& p, std::pair<Index, Index>& x) const {
    p.require_list(2);
    read(p.entry(0), x.first);
    read(p.entry(1), x.second);
  }
  template <class T>
  void read(const Place& p, std::vector<T>& x) const {
    if (!p.value.is_array()) p.fail("give a list");
    x.resize(p.value.size());
    for (std::size_t i = 0; i < x.size(); ++i) read(p.entry(i), x[i]);
  }
  template <class T>
  void read(const Place& p, std::optional<T>& x) const {
    read(p, x.emplace());
  }
  template <class E>
    requires std::is_enum_v<E>
  void read(const Place& p, E& x) const {
    std::string known;
    for (const auto& [name, value] : values_of<E>) {
      if (p.value == name || (p.value.is_string() && present_name(p.value.get<std::string>()) == name))
        return void(x = value);
      known += (known.empty() ? "" : ", ") + std::string(name);
    }
    p.fail("give one of " + known);
  }
  void read(const Place& p, Look& x) const {
    std::uint32_t index = 0;
    read(p, index);
    if (index >= shapes_.size()) p.fail("there is no such shape in \"shapes\"");
    x = shapes_[index];
  }
  void read(const Place& p, Shape& x) const {
    Look look;
    read(p, look);
    if (!look.shape) p.fail("there is no such shape in \"shapes\": that one is for pictures");
    x = *look.shape;
  }
  // A part of the model. Every key of the object must be known, so that nothing that affects motion is lost.
  // Null means the default of the field.
  template <Described T>
  void read(const Place& p, T& part) const {
    if (!p.value.is_object()) p.fail("give an object");
    if constexpr (std::is_same_v<T, Geom>)
      if (!p.value.contains("shape")) p.fail("there is no \"shape\"");
    // Lambdas of Clang before 16 capture no structured bindings.
    for (const auto& item : p.value.items()) {
      const std::string key = present_name(item.key());
      const auto& value = item.value();
      // Before actuators were parts of a model, the key had names of motors, which its joints have still.
      if (std::is_same_v<T, ModelDescription> && key == "actuators" && !value.is_array()) continue;
      const auto take = [&](const auto& field) {
        if (key != field.name) return false;
        if (!value.is_null()) read({value, &p, field.name}, part.*field.member);
        return true;
      };
      if (!std::apply([&](const auto&... field) { return (take(field) || ...); }, fields<T>) &&
          std::find(passed_over<T>.begin(), passed_over<T>.end(), key) == passed_over<T>.end())
        p.fail("\"" + key + "\" is not known here; the file may be of a newer version");
    }
  }

 private:
  Look shape_of(const Place& p) const {
    if (!p.value.is_object() || !p.value.contains("kind")) p.fail("give an object with a \"kind\"");
    const Json& kind = p.value["kind"];
    try {
      Look look;
      if (kind == picture_mesh) {
        PictureMesh mesh;
        read_lengths(p, mesh);
        look.mesh = std::make_shared<const PictureMesh>(std::move(mesh));
        return look;
      }
      const auto take = [&]<class S>() {
        if (kind != detail::shape_name<S>) return false;
        look.shape = shape_of_kind(p, std::type_identity<S>());
        validate(*look.shape);
        return true;
      };
      if (detail::any_shape(take)) return look;
    } catch (const InputError& error) {  // thrown by the shape's constructor, which does not know the place
      if (std::string_view(error.what()).starts_with(p.path())) throw;
      p.fail(error.what());
    }
    p.fail("the kind of shape is not known");
  }
  // A value that has no default. A shape without its size is no shape, and a message says so before the
  // constructor of the shape is asked.
  template <class T>
  void require(const Place& p, const char* key, T& value) const {
    if (!p.value.contains(key)) p.fail(std::string("there is no \"") + key + "\"");
    read(p.field(key), value);
  }
  template <Described S>
  void read_lengths(const Place& p, S& shape) const {
    std::apply([&](const auto&... field) { (require(p, field.name, shape.*field.member), ...); }, fields<S>);
  }
  // By overload: a shape of a few lengths has its fields, the others have arrays from which they are made.
  template <Described S>
  Shape shape_of_kind(const Place& p, std::type_identity<S>) const {
    S shape{};
    read_lengths(p, shape);
    return shape;
  }
  template <class S>
  Shape shape_of_triangles(const Place& p, S make(std::span<const Vec3>, std::span<const Triangle>)) const {
    std::vector<Vec3> points;
    std::vector<Triangle> triangles;
    require(p, "vertices", points);
    require(p, "triangles", triangles);
    return make(points, triangles);
  }
  Shape shape_of_kind(const Place& p, std::type_identity<Hull>) const {
    return shape_of_triangles(p, make_hull);
  }
  Shape shape_of_kind(const Place& p, std::type_identity<Mesh>) const {
    return shape_of_triangles(p, make_mesh);
  }
  Shape shape_of_kind(const Place& p, std::type_identity<HeightField>) const {
    std::vector<std::vector<double>> heights;
    double size_x = 0, size_y = 0;
    require(p, "heights", heights);
    require(p, "size_x", size_x);
    require(p, "size_y", size_y);
    return grid_of(heights, size_x, size_y);
  }
  static Shape grid_of(const std::vector<std::vector<double>>& rows, double size_x, double size_y) {
    std::vector<double> heights;
    for (const auto& row : rows) {
      AMONTONS_REQUIRE(row.size() == rows[0].size(), "the rows of heights differ in length");
      heights.insert(heights.end(), row.begin(), row.end());
    }
    return make_height_field(heights, rows.size(), rows.empty() ? 0 : rows[0].size(), size_x, size_y);
  }

  std::vector<Look> shapes_;
};

// Writes a part by its fields, so that a field that fields.hpp names is written without more. Each write() is
// the counterpart of a read() above: what one of them gives, the other takes.
class Writer {
 public:
  Json shapes = Json::array();

  // None is const: a list of shapes adds to `shapes`, and among overloads the const one would lose to the
  // template. JSON has no infinity, so it is a text. NaN does not come here, because it does not pass the
  // check of a model.
  Json write(double x) {
    if (std::isinf(x)) return x > 0 ? "Infinity" : "-Infinity";
    return x;
  }
  Json write(bool x) { return x; }
  Json write(const std::string& x) { return x; }
  template <std::integral T>
  Json write(T x) {
    return x;
  }
  Json write(const Vec3& x) { return {write(x[0]), write(x[1]), write(x[2])}; }
  Json write(const Quat& x) { return {x.w, x.x, x.y, x.z}; }
  Json write(const Mat3& x) { return {write(x.row[0]), write(x.row[1]), write(x.row[2])}; }
  Json write(const std::pair<Index, Index>& x) { return {x.first, x.second}; }
  template <class T>
  Json write(const std::optional<T>& x) {
    return x ? write(*x) : Json();
  }
  template <class E>
    requires std::is_enum_v<E>
  Json write(E x) {
    const auto& known = values_of<E>;
    return std::find_if(known.begin(), known.end(), [&](const auto& one) { return one.value == x; })->name;
  }
  template <class T>
    requires requires(const T& x) { x.begin(); }
  Json write(const T& list) {
    Json out = Json::array();
    for (const auto& part : list) out.push_back(write(part));
    return out;
  }
  // Its index among the shapes. Geoms that share corners share the shape: a hull of a thousand corners that a
  // hundred geoms have stands once in the file. Primitives are short, and are written for each geom.
  Json write(const Shape& shape) {
    const void* corners = std::visit(
        [](const auto& s) -> const void* {
          if constexpr (requires { s.data; }) return s.data.get();
          return nullptr;
        },
        shape);
    return listed(corners, [&] { return written_shape(shape); });
  }
  Json write(const Look& look) {
    if (look.shape) return write(*look.shape);
    if (!look.mesh) return {};
    return listed(look.mesh.get(), [&] {
      Json out = write(*look.mesh);
      out["kind"] = picture_mesh;
      return out;
    });
  }
  Json written_shape(const Shape& shape) {
    return std::visit(
        [this]<class S>(const S& s) {
          Json out = written(s);
          out["kind"] = detail::shape_name<S>;
          return out;
        },
        shape);
  }
  template <Described T>
  Json write(const T& part) {
    Json out = Json::object();
    std::apply([&](const auto&... field) { ((out[field.name] = write(part.*field.member)), ...); },
               fields<T>);
    // C++ marks a missing coefficient by a number below zero. In the file it is null, as None in Python, so
    // that a reader needs no number with a second meaning.
    if constexpr (std::is_same_v<T, Material>)
      for (auto& [key, value] : out.items())
        if (value.is_number() && value.template get<double>() < 0) value = nullptr;
    if constexpr (std::is_same_v<T, Dof>)
      if (part.friction_static < 0) out["friction_static"] = nullptr;
    if constexpr (std::is_same_v<T, Geom>)
      if (part.friction_direction == Vec3()) out["friction_direction"] = nullptr;
    return out;
  }

 private:
  // The index of a shape by its corners; primitives have none, and share the entry of the null pointer, which
  // is not asked for.
  std::map<const void*, std::size_t> known_;

  Json listed(const void* corners, auto&& make) {
    const auto [known, added] = known_.try_emplace(corners, shapes.size());
    if (corners && !added) return known->second;
    shapes.push_back(make());
    return shapes.size() - 1;
  }
  template <Described S>
  Json written(const S& s) {
    return write(s);
  }
  Json written(const Hull& s) {
    return {{"vertices", write(s.data->given_vertices)}, {"triangles", write(s.data->given_triangles)}};
  }
  Json written(const Mesh& s) {
    return {{"vertices", write(vertices_of(s))}, {"triangles", write(triangles_of(s))}};
  }
  Json written(const HeightField& s) {
    const Heights field = heights_of(s);
    Json rows = Json::array();
    for (std::size_t r = 0; r < field.rows; ++r)
      rows.push_back(write(field.values.subspan(r * field.columns, field.columns)));
    return {{"heights", std::move(rows)}, {"size_x", field.size_x}, {"size_y", field.size_y}};
  }
};

}  // namespace

// Keys come in alphabetical order, so that two models with the same content give the same text. The shapes
// are taken last: they fill while the geoms are written.
std::string write_model_json(const ModelDescription& description) {
  Writer writer;
  Json model = writer.write(description);
  model["version"] = model_json_version;
  model["shapes"] = std::move(writer.shapes);
  return model.dump(-1, ' ', true);  // in ASCII, whatever the names are
}

ModelDescription read_model_json(std::string_view text, const std::string& who) {
  try {
    const Json file = Json::parse(text);
    ModelDescription description;
    const Place all{file};
    Reader(all).read(all, description);
    return description;
  } catch (const InputError& error) {
    throw InputError(who + ": " + error.what());
  } catch (const Json::exception& error) {  // "[json.exception.parse_error.101] parse error at line 1, ..."
    const std::string_view said = error.what();
    throw InputError(who + ": no JSON: " + std::string(said.substr(said.find("] ") + 2)));
  }
}

namespace {
// UTF-8 on every system: string() uses the code page of Windows, and throws if that lacks a letter.
std::string shown(const std::filesystem::path& file) {
  const std::u8string name = file.u8string();
  return {name.begin(), name.end()};
}
}  // namespace

ModelDescription read_model_file(const std::filesystem::path& file) {
  std::error_code error;
  AMONTONS_REQUIRE(std::filesystem::is_regular_file(file, error), shown(file) + ": no such file");
  std::ifstream stream(file, std::ios::binary);
  AMONTONS_REQUIRE(stream.is_open(), shown(file) + ": the file cannot be opened; look at its permissions");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  return read_model_json(text, shown(file));
}

void write_model_file(const ModelDescription& description, const std::filesystem::path& file) {
  // The text first goes to a file beside it, so that a full disk or a name that cannot be replaced leaves
  // what was there.
  std::filesystem::path part = file;
  part += ".part";
  std::ofstream stream(part, std::ios::binary);
  stream << write_model_json(description);
  // A full disk shows only when the last bytes are written, so the stream is closed before it is asked.
  stream.close();
  std::error_code fault;
  if (stream.good()) std::filesystem::rename(part, file, fault);
  if (stream.good() && !fault) return;
  std::filesystem::remove(part, fault);
  throw InputError(shown(file) + ": the file cannot be written; look at the folder and the disk");
}

}  // namespace amontons
