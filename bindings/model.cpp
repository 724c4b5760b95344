#include "amontons/multibody/model/model.hpp"

#include "amontons/multibody/contacts/overlaps.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "bindings.hpp"
#include "math_casters.hpp"

namespace amontons::python {

namespace {

void bind_names(nb::module_& m) {
  nb::enum_<Motion>(m, "Motion")
      .value("dynamic", Motion::dynamic)
      .value("kinematic", Motion::kinematic)
      .value("fixed", Motion::fixed);
  nb::enum_<FrictionRule>(m, "FrictionRule")
      .value("geometric_mean", FrictionRule::geometric_mean)
      .value("maximum", FrictionRule::maximum)
      .value("minimum", FrictionRule::minimum)
      .value("mean", FrictionRule::mean);
  nb::enum_<MotorKind>(m, "MotorKind")
      .value("none", MotorKind::none)
      .value("effort", MotorKind::effort)
      .value("speed", MotorKind::speed)
      .value("position", MotorKind::position);
  nb::enum_<Dof::Kind>(m, "DofKind").value("hinge", Dof::Kind::hinge).value("slide", Dof::Kind::slide);
  nb::enum_<JointKind>(m, "JointKind")
      .value("chain", JointKind::chain)
      .value("distance", JointKind::distance);
  nb::enum_<PathElement::Kind>(m, "PathKind")
      .value("point", PathElement::Kind::point)
      .value("sphere", PathElement::Kind::sphere)
      .value("cylinder", PathElement::Kind::cylinder)
      .value("pulley", PathElement::Kind::pulley);
  nb::enum_<Transmission::Kind>(m, "TransmissionKind")
      .value("dof", Transmission::Kind::dof)
      .value("tendon", Transmission::Kind::tendon)
      .value("wrench", Transmission::Kind::wrench)
      .value("slider_crank", Transmission::Kind::slider_crank);
  nb::enum_<ActivationKind>(m, "ActivationKind")
      .value("none", ActivationKind::none)
      .value("integrator", ActivationKind::integrator)
      .value("filter", ActivationKind::filter);
}

void bind_bodies(nb::module_& m) {
  nb::class_<Material>(m, "Material")
      .def(nb::init<>())
      .def_rw("friction", &Material::friction)
      .def_rw("restitution", &Material::restitution)
      .def_rw("compliance", &Material::compliance)
      .def_rw("relaxation_time", &Material::relaxation_time)
      .def_rw("rest_offset", &Material::rest_offset)
      .def_rw("friction_across", &Material::friction_across)
      .def_rw("torsional_friction", &Material::torsional_friction)
      .def_rw("rolling_friction", &Material::rolling_friction);
  nb::class_<Body>(m, "Body")
      .def(nb::init<>())
      .def_rw("name", &Body::name)
      .def_rw("motion", &Body::motion)
      .def_rw("mass", &Body::mass)
      .def_rw("centre_of_mass", &Body::centre_of_mass)
      .def_rw("inertia", &Body::inertia)
      .def_rw("gravity_scale", &Body::gravity_scale)
      .def_rw("pose", &Body::pose)
      .def_rw("linear_velocity", &Body::linear_velocity)
      .def_rw("angular_velocity", &Body::angular_velocity);
  nb::class_<Geom>(m, "Geom")
      .def(nb::init<>())
      .def_rw("name", &Geom::name)
      .def_rw("body", &Geom::body)
      .def_rw("frame", &Geom::frame)
      .def_rw("shape", &Geom::shape)
      .def_rw("material", &Geom::material)
      .def_rw("surface_velocity", &Geom::surface_velocity)
      .def_rw("surface_spin", &Geom::surface_spin)
      .def_rw("friction_direction", &Geom::friction_direction)
      .def_rw("category", &Geom::category)
      .def_rw("mask", &Geom::mask);
  nb::class_<PairMaterial>(m, "PairMaterial")
      .def(
          "__init__",
          [](PairMaterial* self, Index a, Index b, const Material& material, bool always) {
            new (self) PairMaterial{a, b, material, always};
          },
          nb::arg("geom_a"), nb::arg("geom_b"), nb::arg("material"), nb::arg("always"))
      .def(nb::init<>())
      .def_rw("geom_a", &PairMaterial::geom_a)
      .def_rw("geom_b", &PairMaterial::geom_b)
      .def_rw("material", &PairMaterial::material)
      .def_rw("always", &PairMaterial::always);
}

void bind_joints(nb::module_& m) {
  nb::class_<Motor>(m, "Motor")
      .def(nb::init<>())
      .def_rw("kind", &Motor::kind)
      .def_rw("target", &Motor::target)
      .def_rw("max_effort", &Motor::max_effort)
      .def_rw("gain", &Motor::gain)
      .def_rw("damping_gain", &Motor::damping_gain);
  nb::class_<Dof>(m, "Dof")
      .def(nb::init<>())
      .def_rw("kind", &Dof::kind)
      .def_rw("axis", &Dof::axis)
      .def_rw("anchor", &Dof::anchor)
      .def_rw("lower", &Dof::lower)
      .def_rw("upper", &Dof::upper)
      .def_rw("stiffness", &Dof::stiffness)
      .def_rw("rest", &Dof::rest)
      .def_rw("damping", &Dof::damping)
      .def_rw("friction", &Dof::friction)
      .def_rw("armature", &Dof::armature)
      .def_rw("lower_effort", &Dof::lower_effort)
      .def_rw("upper_effort", &Dof::upper_effort)
      .def_rw("motor", &Dof::motor);
  nb::class_<Joint>(m, "Joint")
      .def(nb::init<>())
      .def_rw("name", &Joint::name)
      .def_rw("kind", &Joint::kind)
      .def_rw("body_a", &Joint::body_a)
      .def_rw("body_b", &Joint::body_b)
      .def_rw("frame_a", &Joint::frame_a)
      .def_rw("frame_b", &Joint::frame_b)
      .def_rw("dofs", &Joint::dofs)
      .def_rw("spherical", &Joint::spherical)
      .def_rw("ball_stiffness", &Joint::ball_stiffness)
      .def_rw("ball_damping", &Joint::ball_damping)
      .def_rw("ball_armature", &Joint::ball_armature)
      .def_rw("ball_friction", &Joint::ball_friction)
      .def_rw("ball_limit", &Joint::ball_limit)
      .def_rw("lower_distance", &Joint::lower_distance)
      .def_rw("upper_distance", &Joint::upper_distance)
      .def_rw("compliance", &Joint::compliance)
      .def_rw("collide", &Joint::collide)
      .def_rw("closes_loop", &Joint::closes_loop);
  nb::class_<Coupling>(m, "Coupling")
      .def(nb::init<>())
      .def_rw("name", &Coupling::name)
      .def_rw("joint_a", &Coupling::joint_a)
      .def_rw("dof_a", &Coupling::dof_a)
      .def_rw("joint_b", &Coupling::joint_b)
      .def_rw("dof_b", &Coupling::dof_b)
      .def_rw("coefficients", &Coupling::coefficients)
      .def_rw("compliance", &Coupling::compliance)
      .def_rw("tendon_a", &Coupling::tendon_a)
      .def_rw("tendon_b", &Coupling::tendon_b);
}

void bind_tendons(nb::module_& m) {
  nb::class_<TendonTerm>(m, "TendonTerm")
      .def(nb::init<>())
      .def_rw("joint", &TendonTerm::joint)
      .def_rw("dof", &TendonTerm::dof)
      .def_rw("coefficient", &TendonTerm::coefficient);
  nb::class_<PathElement>(m, "PathElement")
      .def(nb::init<>())
      .def_rw("kind", &PathElement::kind)
      .def_rw("body", &PathElement::body)
      .def_rw("frame", &PathElement::frame)
      .def_rw("radius", &PathElement::radius)
      .def_rw("side", &PathElement::side, nb::arg().none())
      .def_rw("side_body", &PathElement::side_body)
      .def_rw("divisor", &PathElement::divisor);
  nb::class_<Tendon>(m, "Tendon")
      .def(nb::init<>())
      .def_rw("name", &Tendon::name)
      .def_rw("terms", &Tendon::terms)
      .def_rw("path", &Tendon::path)
      .def_rw("lower", &Tendon::lower)
      .def_rw("upper", &Tendon::upper)
      .def_rw("stiffness", &Tendon::stiffness)
      .def_rw("rest_lower", &Tendon::rest_lower)
      .def_rw("rest_upper", &Tendon::rest_upper)
      .def_rw("damping", &Tendon::damping)
      .def_rw("friction", &Tendon::friction)
      .def_rw("armature", &Tendon::armature);
}

void bind_actuators(nb::module_& m) {
  nb::class_<Transmission>(m, "Transmission")
      .def(nb::init<>())
      .def_rw("kind", &Transmission::kind)
      .def_rw("joint", &Transmission::joint)
      .def_rw("dof", &Transmission::dof)
      .def_rw("tendon", &Transmission::tendon)
      .def_rw("body", &Transmission::body)
      .def_rw("reference_body", &Transmission::reference_body)
      .def_rw("frame", &Transmission::frame)
      .def_rw("reference", &Transmission::reference)
      .def_rw("force", &Transmission::force)
      .def_rw("torque", &Transmission::torque)
      .def_rw("own_axes", &Transmission::own_axes)
      .def_rw("rod", &Transmission::rod)
      .def_rw("gear", &Transmission::gear);
  nb::class_<Actuator>(m, "Actuator")
      .def(nb::init<>())
      .def_rw("name", &Actuator::name)
      .def_rw("transmission", &Actuator::transmission)
      .def_rw("gain", &Actuator::gain)
      .def_rw("bias", &Actuator::bias)
      .def_rw("lower_force", &Actuator::lower_force)
      .def_rw("upper_force", &Actuator::upper_force)
      .def_rw("control", &Actuator::control)
      .def_rw("lower_control", &Actuator::lower_control)
      .def_rw("upper_control", &Actuator::upper_control)
      .def_rw("dynamics", &Actuator::dynamics)
      .def_rw("time_constant", &Actuator::time_constant)
      .def_rw("activation", &Actuator::activation)
      .def_rw("lower_activation", &Actuator::lower_activation)
      .def_rw("upper_activation", &Actuator::upper_activation)
      .def_rw("early", &Actuator::early);
}

void bind_fluid(nb::module_& m) {
  nb::class_<Fluid>(m, "Fluid")
      .def(nb::init<>())
      .def_rw("density", &Fluid::density)
      .def_rw("viscosity", &Fluid::viscosity)
      .def_rw("wind", &Fluid::wind);
  nb::class_<FluidBox>(m, "FluidBox")
      .def(nb::init<>())
      .def_rw("body", &FluidBox::body)
      .def_rw("frame", &FluidBox::frame)
      .def_rw("size", &FluidBox::size);
}

}  // namespace

void bind_model(nb::module_& m) {
  bind_names(m);
  bind_bodies(m);
  bind_joints(m);
  bind_fluid(m);
  bind_tendons(m);
  bind_actuators(m);
  using D = ModelDescription;
  nb::class_<D>(m, "ModelDescription")
      .def(nb::init<>())
      .def_rw("gravity", &D::gravity)
      .def_rw("bodies", &D::bodies)
      .def_rw("geoms", &D::geoms)
      .def_rw("joints", &D::joints)
      .def_rw("tendons", &D::tendons)
      .def_rw("couplings", &D::couplings)
      .def_rw("actuators", &D::actuators)
      .def_rw("pair_materials", &D::pair_materials)
      .def_rw("excluded_bodies", &D::excluded_bodies)
      .def_rw("excluded_geoms", &D::excluded_geoms)
      .def_rw("fluid", &D::fluid)
      .def_rw("fluid_boxes", &D::fluid_boxes)
      .def_rw("friction_rule", &D::friction_rule);
  nb::class_<Model>(m, "Model", "A checked description, which never changes.")
      .def(nb::new_([](const D& description) { return std::make_shared<Model>(description); }),
           nb::arg("description"))
      .def_prop_ro("dofs", &Model::dofs)
      .def_prop_ro("length", &Model::length)
      .def_prop_ro("total_mass", &Model::total_mass)
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
