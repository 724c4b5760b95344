#include "amontons/multibody/model/model.hpp"

#include "amontons/multibody/contacts/overlaps.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/model/builder.hpp"
#include "amontons/multibody/model/model_json.hpp"
#include "parts.hpp"

namespace amontons::python {

namespace {

template <class E>
void bind_names(nb::module_& m, const char* name) {
  nb::enum_<E> kind(m, name);
  for (const auto& [text, value] : detail::values_of<E>) kind.value(text, value);
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
}

// The arithmetic of ModelBuilder: what the builder of Python makes its parts with.
void bind_builder(nb::module_& m) {
  nb::class_<JointEnd>(m, "JointEnd")
      .def(nb::init<Index, const Transform&, const Transform&>(), nb::arg("body"), nb::arg("pose"),
           nb::arg("part"));
  m.def("dofs_of_kind", &dofs_of_kind, nb::arg("kind"));
  m.def(
      "joint_between",
      [](const std::string& kind, const JointEnd& a, const JointEnd& b, const nb::callable& make,
         const nb::kwargs& given) {
        PartReader reader;
        return PartTeller(make).told(kind == "distance"
                                         ? rod_between(a, b, reader.part<NewRod>(given))
                                         : joint_between(kind, a, b, reader.part<NewJoint>(given)));
      },
      nb::arg("kind"), nb::arg("a"), nb::arg("b"), nb::arg("make"), nb::arg("given"));
  m.def(
      "solid_of",
      [](const std::string& who, const nb::kwargs& given) {
        const MassProperties s = solid_of(PartReader().part<NewBody>(given), who);
        return std::tuple(s.mass, s.centre_of_mass, s.inertia);
      },
      nb::arg("who"), nb::arg("given"), "(mass, centre, inertia) of a new body.");
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
  bind_looks(m);
  bind_builder(m);
  m.def(
      "write_model",
      [](nb::handle description) {
        return write_model_json(PartReader().part<ModelDescription>(description));
      },
      nb::arg("description"), "Its JSON text.");
  m.def(
      "read_model",
      [](const std::string& text, const std::string& who, const nb::callable& make) {
        const ModelDescription description = read_model_json(text, who);
        try {
          return PartTeller(make).fields(description);
        } catch (const nb::python_error&) {
          Model checked(description);  // whose message names the part
          throw;
        }
      },
      nb::arg("text"), nb::arg("who"), nb::arg("make"),
      "The fields of a model in a JSON text; InputErrors begin with `who` and name the place.");
  nb::class_<Model>(m, "Model", "A checked description, which never changes.")
      .def(nb::new_([](nb::handle description) {
             return std::make_shared<Model>(PartReader().part<ModelDescription>(description));
           }),
           nb::arg("description"))
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
      .def(
          "material",
          [](const Model& model, Index a, Index b, const nb::callable& make) {
            return PartTeller(make).told(model.material(a, b));
          },
          nb::arg("geom_a"), nb::arg("geom_b"), nb::arg("make"))
      .def(
          "first_dof",
          [](const Model& model, std::size_t joint) {
            AMONTONS_REQUIRE(joint < model.joints(), "first_dof: there is no such joint");
            return model.first_dof(joint);
          },
          nb::arg("joint"));
}

}  // namespace amontons::python
