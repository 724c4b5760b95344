#pragma once
#include <tuple>

#include "amontons/multibody/model/description.hpp"

// The fields of a description and of its parts by name, and the names of its enumerations. Files and bindings
// use these tables, so that a new field is named once.
namespace amontons::detail {

template <class Owner, class Value>
struct Field {
  const char* name;
  Value Owner::* member;
};
// Compilers before 2023 deduce no arguments of aggregates.
template <class Owner, class Value>
Field(const char*, Value Owner::*) -> Field<Owner, Value>;

// fields<T> is a tuple of the Field of T, for every T below.
template <class T>
inline constexpr auto fields = 0;
template <class T>
concept Described = !std::is_same_v<decltype(fields<T>), const int>;

template <>
inline constexpr auto fields<Transform> =
    std::tuple(Field{"position", &Transform::position}, Field{"rotation", &Transform::rotation});

template <>
inline constexpr auto fields<Material> = std::tuple(
    Field{"friction", &Material::friction}, Field{"restitution", &Material::restitution},
    Field{"compliance", &Material::compliance}, Field{"relaxation_time", &Material::relaxation_time},
    Field{"rest_offset", &Material::rest_offset}, Field{"friction_across", &Material::friction_across},
    Field{"torsional_friction", &Material::torsional_friction},
    Field{"rolling_friction", &Material::rolling_friction},
    Field{"friction_static", &Material::friction_static}, Field{"stribeck_speed", &Material::stribeck_speed});

template <>
inline constexpr auto fields<Body> = std::tuple(
    Field{"name", &Body::name}, Field{"motion", &Body::motion}, Field{"mass", &Body::mass},
    Field{"centre_of_mass", &Body::centre_of_mass}, Field{"inertia", &Body::inertia},
    Field{"gravity_scale", &Body::gravity_scale}, Field{"pose", &Body::pose},
    Field{"linear_velocity", &Body::linear_velocity}, Field{"angular_velocity", &Body::angular_velocity});

template <>
inline constexpr auto fields<Geom> =
    std::tuple(Field{"name", &Geom::name}, Field{"body", &Geom::body}, Field{"frame", &Geom::frame},
               Field{"shape", &Geom::shape}, Field{"material", &Geom::material},
               Field{"surface_velocity", &Geom::surface_velocity}, Field{"surface_spin", &Geom::surface_spin},
               Field{"friction_direction", &Geom::friction_direction}, Field{"category", &Geom::category},
               Field{"mask", &Geom::mask});

template <>
inline constexpr auto fields<PairMaterial> =
    std::tuple(Field{"geom_a", &PairMaterial::geom_a}, Field{"geom_b", &PairMaterial::geom_b},
               Field{"material", &PairMaterial::material}, Field{"always", &PairMaterial::always});

template <>
inline constexpr auto fields<Motor> =
    std::tuple(Field{"kind", &Motor::kind}, Field{"control", &Motor::control},
               Field{"max_effort", &Motor::max_effort}, Field{"kp", &Motor::kp}, Field{"kd", &Motor::kd});

template <>
inline constexpr auto fields<Dof> =
    std::tuple(Field{"kind", &Dof::kind}, Field{"axis", &Dof::axis}, Field{"anchor", &Dof::anchor},
               Field{"lower", &Dof::lower}, Field{"upper", &Dof::upper}, Field{"stiffness", &Dof::stiffness},
               Field{"rest", &Dof::rest}, Field{"damping", &Dof::damping}, Field{"friction", &Dof::friction},
               Field{"friction_static", &Dof::friction_static}, Field{"stribeck_speed", &Dof::stribeck_speed},
               Field{"armature", &Dof::armature}, Field{"lower_effort", &Dof::lower_effort},
               Field{"upper_effort", &Dof::upper_effort}, Field{"motor", &Dof::motor});

template <>
inline constexpr auto fields<Joint> = std::tuple(
    Field{"name", &Joint::name}, Field{"kind", &Joint::kind}, Field{"body_a", &Joint::body_a},
    Field{"body_b", &Joint::body_b}, Field{"frame_a", &Joint::frame_a}, Field{"frame_b", &Joint::frame_b},
    Field{"dofs", &Joint::dofs}, Field{"spherical", &Joint::spherical},
    Field{"ball_stiffness", &Joint::ball_stiffness}, Field{"ball_damping", &Joint::ball_damping},
    Field{"ball_armature", &Joint::ball_armature}, Field{"ball_friction", &Joint::ball_friction},
    Field{"ball_limit", &Joint::ball_limit}, Field{"lower_distance", &Joint::lower_distance},
    Field{"upper_distance", &Joint::upper_distance}, Field{"compliance", &Joint::compliance},
    Field{"collide", &Joint::collide}, Field{"closes_loop", &Joint::closes_loop}, Field{"play", &Joint::play},
    Field{"play_length", &Joint::play_length}, Field{"journal_radius", &Joint::journal_radius},
    Field{"play_friction", &Joint::play_friction});

template <>
inline constexpr auto fields<Coupling> =
    std::tuple(Field{"name", &Coupling::name}, Field{"joint_a", &Coupling::joint_a},
               Field{"dof_a", &Coupling::dof_a}, Field{"joint_b", &Coupling::joint_b},
               Field{"dof_b", &Coupling::dof_b}, Field{"coefficients", &Coupling::coefficients},
               Field{"compliance", &Coupling::compliance}, Field{"tendon_a", &Coupling::tendon_a},
               Field{"tendon_b", &Coupling::tendon_b}, Field{"backlash", &Coupling::backlash});

template <>
inline constexpr auto fields<Fluid> = std::tuple(
    Field{"density", &Fluid::density}, Field{"viscosity", &Fluid::viscosity}, Field{"wind", &Fluid::wind});

template <>
inline constexpr auto fields<FluidBox> = std::tuple(
    Field{"body", &FluidBox::body}, Field{"frame", &FluidBox::frame}, Field{"size", &FluidBox::size});

template <>
inline constexpr auto fields<TendonTerm> =
    std::tuple(Field{"joint", &TendonTerm::joint}, Field{"dof", &TendonTerm::dof},
               Field{"coefficient", &TendonTerm::coefficient});

template <>
inline constexpr auto fields<PathElement> = std::tuple(
    Field{"kind", &PathElement::kind}, Field{"body", &PathElement::body}, Field{"frame", &PathElement::frame},
    Field{"radius", &PathElement::radius}, Field{"side", &PathElement::side},
    Field{"side_body", &PathElement::side_body}, Field{"divisor", &PathElement::divisor},
    Field{"friction", &PathElement::friction}, Field{"turns", &PathElement::turns});

template <>
inline constexpr auto fields<Tendon> = std::tuple(
    Field{"name", &Tendon::name}, Field{"terms", &Tendon::terms}, Field{"path", &Tendon::path},
    Field{"lower", &Tendon::lower}, Field{"upper", &Tendon::upper}, Field{"stiffness", &Tendon::stiffness},
    Field{"rest_lower", &Tendon::rest_lower}, Field{"rest_upper", &Tendon::rest_upper},
    Field{"damping", &Tendon::damping}, Field{"friction", &Tendon::friction},
    Field{"armature", &Tendon::armature}, Field{"closed", &Tendon::closed});

template <>
inline constexpr auto fields<Transmission> =
    std::tuple(Field{"kind", &Transmission::kind}, Field{"joint", &Transmission::joint},
               Field{"dof", &Transmission::dof}, Field{"tendon", &Transmission::tendon},
               Field{"body", &Transmission::body}, Field{"reference_body", &Transmission::reference_body},
               Field{"frame", &Transmission::frame}, Field{"reference", &Transmission::reference},
               Field{"force", &Transmission::force}, Field{"torque", &Transmission::torque},
               Field{"own_axes", &Transmission::own_axes}, Field{"rod", &Transmission::rod},
               Field{"gear", &Transmission::gear});

template <>
inline constexpr auto fields<Actuator> =
    std::tuple(Field{"name", &Actuator::name}, Field{"transmission", &Actuator::transmission},
               Field{"gain", &Actuator::gain}, Field{"bias", &Actuator::bias},
               Field{"lower_force", &Actuator::lower_force}, Field{"upper_force", &Actuator::upper_force},
               Field{"control", &Actuator::control}, Field{"lower_control", &Actuator::lower_control},
               Field{"upper_control", &Actuator::upper_control}, Field{"dynamics", &Actuator::dynamics},
               Field{"time_constant", &Actuator::time_constant}, Field{"activation", &Actuator::activation},
               Field{"lower_activation", &Actuator::lower_activation},
               Field{"upper_activation", &Actuator::upper_activation}, Field{"early", &Actuator::early});

template <>
inline constexpr auto fields<ModelDescription> = std::tuple(
    Field{"gravity", &ModelDescription::gravity}, Field{"bodies", &ModelDescription::bodies},
    Field{"geoms", &ModelDescription::geoms}, Field{"joints", &ModelDescription::joints},
    Field{"tendons", &ModelDescription::tendons}, Field{"couplings", &ModelDescription::couplings},
    Field{"actuators", &ModelDescription::actuators},
    Field{"pair_materials", &ModelDescription::pair_materials},
    Field{"excluded_bodies", &ModelDescription::excluded_bodies},
    Field{"excluded_geoms", &ModelDescription::excluded_geoms}, Field{"fluid", &ModelDescription::fluid},
    Field{"fluid_boxes", &ModelDescription::fluid_boxes},
    Field{"friction_rule", &ModelDescription::friction_rule}, Field{"trees", &ModelDescription::trees});

// values_of<E> is an array of the values of an enumeration with their names.
template <class E>
struct Named {
  const char* name;
  E value;
};
template <class Value>
Named(const char*, Value) -> Named<Value>;
template <class E>
inline constexpr auto values_of = 0;

template <>
inline constexpr auto values_of<Motion> = std::array{
    Named{"dynamic", Motion::dynamic}, Named{"kinematic", Motion::kinematic}, Named{"fixed", Motion::fixed}};
template <>
inline constexpr auto values_of<FrictionRule> =
    std::array{Named{"geometric_mean", FrictionRule::geometric_mean}, Named{"maximum", FrictionRule::maximum},
               Named{"minimum", FrictionRule::minimum}, Named{"mean", FrictionRule::mean}};
template <>
inline constexpr auto values_of<Trees> =
    std::array{Named{"none", Trees::none}, Named{"auto", Trees::automatic}};
template <>
inline constexpr auto values_of<MotorKind> =
    std::array{Named{"none", MotorKind::none}, Named{"effort", MotorKind::effort},
               Named{"velocity", MotorKind::velocity}, Named{"position", MotorKind::position}};
template <>
inline constexpr auto values_of<Dof::Kind> =
    std::array{Named{"hinge", Dof::Kind::hinge}, Named{"slide", Dof::Kind::slide}};
template <>
inline constexpr auto values_of<JointKind> =
    std::array{Named{"chain", JointKind::chain}, Named{"distance", JointKind::distance}};
template <>
inline constexpr auto values_of<PathElement::Kind> =
    std::array{Named{"point", PathElement::Kind::point}, Named{"sphere", PathElement::Kind::sphere},
               Named{"cylinder", PathElement::Kind::cylinder}, Named{"pulley", PathElement::Kind::pulley}};
template <>
inline constexpr auto values_of<Transmission::Kind> = std::array{
    Named{"dof", Transmission::Kind::dof}, Named{"tendon", Transmission::Kind::tendon},
    Named{"wrench", Transmission::Kind::wrench}, Named{"slider_crank", Transmission::Kind::slider_crank}};
template <>
inline constexpr auto values_of<ActivationKind> =
    std::array{Named{"none", ActivationKind::none}, Named{"integrator", ActivationKind::integrator},
               Named{"filter", ActivationKind::filter}};

}  // namespace amontons::detail
