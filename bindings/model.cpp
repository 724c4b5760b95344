#include "amontons/multibody/model/model.hpp"

#include "amontons/multibody/contacts/overlaps.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/model/builder.hpp"
#include "amontons/multibody/model/model_json.hpp"
#include "bindings.hpp"
#include "math_casters.hpp"

namespace amontons::python {

namespace {

template <class E>
void bind_names(nb::module_& m, const char* name) {
  nb::enum_<E> kind(m, name);
  for (const auto& [text, value] : detail::values_of<E>) kind.value(text, value);
}

template <class T>
constexpr bool is_optional = false;
template <class T>
constexpr bool is_optional<std::optional<T>> = true;

// A class of the description with all its fields.
template <class T>
nb::class_<T> bind_fields(nb::module_& m, const char* name) {
  nb::class_<T> part(m, name);
  part.def(nb::init<>());
  const auto bind = [&]<class Value>(const detail::Field<T, Value>& field) {
    if constexpr (is_optional<Value>)
      part.def_rw(field.name, field.member, nb::arg().none());
    else
      part.def_rw(field.name, field.member);
  };
  std::apply([&](const auto&... field) { (bind(field), ...); }, detail::fields<T>);
  return part;
}

// Parts that no step reads. Python packs and unpacks the meshes of pictures.
void bind_looks(nb::module_& m) {
  nb::class_<Look>(m, "Look", "A shape, or a mesh of pictures as two packed arrays, or neither.")
      .def(nb::init<>())
      .def(
          "__init__", [](Look* self, const Shape& shape) { new (self) Look{shape, {}}; }, nb::arg("shape"))
      .def(
          "__init__",
          [](Look* self, std::string vertices, std::string triangles) {
            new (self) Look{
                {},
                std::make_shared<const PictureMesh>(PictureMesh{std::move(vertices), std::move(triangles)})};
          },
          nb::arg("vertices"), nb::arg("triangles"))
      .def_ro("shape", &Look::shape)
      .def_prop_ro("mesh",
                   [](const Look& look) {
                     return look.mesh ? std::optional(std::pair(look.mesh->vertices, look.mesh->triangles))
                                      : std::nullopt;
                   })
      .def_prop_ro(
          "key", [](const Look& look) { return reinterpret_cast<std::uintptr_t>(look.mesh.get()); },
          "Equal for looks that share a mesh.");
  bind_fields<NamedLink>(m, "Link");
  bind_fields<Site>(m, "Site");
  bind_fields<Sensor>(m, "Sensor");
  bind_fields<Visual>(m, "Visual");
  bind_fields<Keyframe>(m, "Keyframe");
  bind_fields<Unread>(m, "Unread");
}

// A part whose fields are keyword arguments.
template <class T>
T part_of(const nb::kwargs& given) {
  T part;
  const auto take = [&]<class Value>(const detail::Field<T, Value>& field) {
    if (given.contains(field.name)) part.*field.member = nb::cast<Value>(given[field.name]);
  };
  std::apply([&](const auto&... field) { (take(field), ...); }, detail::fields<T>);
  return part;
}

// The arithmetic of ModelBuilder: what the builder of Python makes its parts with.
void bind_builder(nb::module_& m) {
  nb::class_<JointEnd>(m, "JointEnd")
      .def(nb::init<Index, const Transform&, const Transform&>(), nb::arg("body"), nb::arg("pose"),
           nb::arg("part"));
  m.def("dofs_of_kind", &dofs_of_kind, nb::arg("kind"));
  m.def(
      "joint_between",
      [](const std::string& kind, const JointEnd& a, const JointEnd& b, const nb::kwargs& given) {
        return joint_between(kind, a, b, part_of<NewJoint>(given));
      },
      nb::arg("kind"), nb::arg("a"), nb::arg("b"), nb::arg("given"));
  m.def(
      "rod_between",
      [](const JointEnd& a, const JointEnd& b, const nb::kwargs& given) {
        return rod_between(a, b, part_of<NewRod>(given));
      },
      nb::arg("a"), nb::arg("b"), nb::arg("given"));
  m.def(
      "solid_of",
      [](const std::string& who, const nb::kwargs& given) {
        const MassProperties s = solid_of(part_of<NewBody>(given), who);
        return std::tuple(s.mass, s.centre_of_mass, s.inertia);
      },
      nb::arg("who"), nb::arg("given"), "(mass, centre, inertia) of a new body.");
}

void bind_forces(nb::module_& m) {
  bind_fields<Fluid>(m, "Fluid");
  bind_fields<FluidBox>(m, "FluidBox");
  bind_fields<Bond>(m, "Bond");
}

}  // namespace

void bind_model(nb::module_& m) {
  bind_names<Motion>(m, "Motion");
  bind_names<FrictionRule>(m, "FrictionRule");
  bind_names<Trees>(m, "Trees");
  bind_names<MotorKind>(m, "MotorKind");
  bind_names<Dof::Kind>(m, "DofKind");
  bind_names<JointKind>(m, "JointKind");
  bind_names<PathElement::Kind>(m, "PathKind");
  bind_names<Transmission::Kind>(m, "TransmissionKind");
  bind_names<ActivationKind>(m, "ActivationKind");
  bind_fields<Material>(m, "Material");
  bind_fields<Body>(m, "Body");
  bind_fields<Geom>(m, "Geom");
  // Models have one for each pair of some kinds of geoms; assigning fields instead takes four times as long.
  bind_fields<PairMaterial>(m, "PairMaterial")
      .def(
          "__init__",
          [](PairMaterial* self, Index a, Index b, const Material& material, bool always) {
            new (self) PairMaterial{a, b, material, always};
          },
          nb::arg("geom_a"), nb::arg("geom_b"), nb::arg("material"), nb::arg("always"));
  bind_fields<Motor>(m, "Motor");
  bind_fields<Dof>(m, "Dof");
  bind_fields<Joint>(m, "Joint");
  bind_fields<Coupling>(m, "Coupling");
  bind_forces(m);
  bind_fields<TendonTerm>(m, "TendonTerm");
  bind_fields<PathElement>(m, "PathElement");
  bind_fields<Tendon>(m, "Tendon");
  bind_fields<Transmission>(m, "Transmission");
  bind_fields<Actuator>(m, "Actuator");
  bind_looks(m);
  bind_builder(m);
  bind_fields<ModelDescription>(m, "ModelDescription");
  m.def("write_model", &write_model_json, nb::arg("description"), "Its JSON text.");
  m.def("read_model", &read_model_json, nb::arg("text"), nb::arg("who"),
        "The description in a JSON text; InputErrors begin with `who` and name the place.");
  nb::class_<Model>(m, "Model", "A checked description, which never changes.")
      .def(nb::new_([](const ModelDescription& description) { return std::make_shared<Model>(description); }),
           nb::arg("description"))
      .def_prop_ro(
          "description", [](const Model& model) { return model.description(); }, "A copy.")
      .def_prop_ro("dofs", &Model::dofs)
      .def_prop_ro("length", &Model::length)
      .def_prop_ro("total_mass", &Model::total_mass)
      .def_prop_ro(
          "controls",
          [](const Model& model) {
            std::vector<std::tuple<Index, Index, Index>> out;
            for (const Control& c : model.controls()) out.emplace_back(c.actuator, c.joint, c.dof);
            return out;
          },
          "(actuator, joint, dof) of every control; without an actuator it is that of a motor.")
      .def(
          "overlaps",
          [](const Model& model, double depth) {
            return overlapping_geoms(model, initial_state(model), depth);
          },
          nb::arg("depth"), "Pairs of geoms that may touch and overlap by more in the initial state.")
      .def("may_touch", &Model::may_touch, nb::arg("geom_a"), nb::arg("geom_b"))
      .def("material", &Model::material, nb::arg("geom_a"), nb::arg("geom_b"))
      .def(
          "first_dof",
          [](const Model& model, std::size_t joint) {
            AMONTONS_REQUIRE(joint < model.joints(), "first_dof: there is no such joint");
            return model.first_dof(joint);
          },
          nb::arg("joint"));
}

}  // namespace amontons::python
