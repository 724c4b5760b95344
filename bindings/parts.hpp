#pragma once
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "amontons/multibody/model/builder.hpp"
#include "bindings.hpp"
#include "math_casters.hpp"

// Parts of a model between Python and C++, by the tables of the names of their fields. A part is no class of
// the module, and a new field needs nothing here. Python hands in objects with these attributes, or
// dictionaries. On the way back it makes its parts: by a function of their kind and their fields.
namespace amontons::python {

// Parts that go to Python, with the names of their classes there.
template <class T>
struct PartName {
  const char* name;
};
#define AMONTONS_PART(unused, T) \
  PartName<T> { #T }
using Link = NamedLink;
inline constexpr auto parts = std::tuple(AMONTONS_SCANS(AMONTONS_EACH(
    AMONTONS_PART, , Material, Body, Geom, PairMaterial, Motor, Dof, Joint, Coupling, Fluid, FluidBox, Bond,
    TendonTerm, PathElement, Tendon, Transmission, Actuator, Link, Site, Sensor, Visual, Keyframe, Unread)));
#undef AMONTONS_PART
template <class T>
concept Part = detail::Described<T> && !std::is_same_v<T, Transform>;

class PartReader {
 public:
  template <Part T>
  T part(nb::handle given) {
    T out{};
    read(given, out);
    return out;
  }

 private:
  // A field that is missing or None keeps its default. Throws InputError naming the field.
  template <Part T>
  void read(nb::handle given, T& part) {
    const auto take = [&]<class Value>(const detail::Field<T, Value>& field) {
      const nb::object value = found(given, field.name);
      if (!value.is_valid() || value.is_none()) return;
      try {
        read(value, part.*field.member);
      } catch (const nb::cast_error&) {
        refuse(given, field.name, value);
      } catch (const nb::python_error&) {
        refuse(given, field.name, value);
      }
    };
    std::apply([&](const auto&... field) { (take(field), ...); }, detail::fields<T>);
  }
  // There may be a million pairs, which share few materials.
  void read(nb::handle given, PairMaterial& pair) {
    pair.geom_a = nb::cast<Index>(given.attr("geom_a"));
    pair.geom_b = nb::cast<Index>(given.attr("geom_b"));
    pair.always = nb::cast<bool>(given.attr("always"));
    const nb::object material = given.attr("material");
    const auto [known, fresh] = materials_.try_emplace(material.ptr());
    if (fresh) read(material, known->second);
    pair.material = known->second;
  }
  template <class E>
    requires std::is_enum_v<E>
  void read(nb::handle given, E& out) {
    const auto name = nb::cast<std::string>(given);
    for (const auto& [known, value] : detail::values_of<E>)
      if (name == known) return void(out = value);
    throw nb::cast_error();
  }
  template <class T>
  void read(nb::handle given, std::vector<T>& out) {
    for (const nb::handle one : given) read(one, out.emplace_back());
  }
  template <class T>
  void read(nb::handle given, std::optional<T>& out) {
    read(given, out.emplace());
  }
  void read(nb::handle given, Transform& out) {
    out = {nb::cast<Vec3>(given.attr("position")), nb::cast<Quat>(given.attr("rotation"))};
  }
  void read(nb::handle given, Shape& out) { out = nb::cast<Shape>(given.attr("core")); }
  template <class T>
  void read(nb::handle given, T& out) {
    out = nb::cast<T>(given);
  }

  static nb::object found(nb::handle given, const char* name) {
    if (nb::isinstance<nb::dict>(given)) return nb::borrow(PyDict_GetItemString(given.ptr(), name));
    return nb::getattr(given, name, nb::object());
  }
  [[noreturn]] static void refuse(nb::handle given, const char* name, nb::handle value) {
    PyErr_Clear();
    std::string said = nb::cast<std::string>(nb::repr(value));
    if (said.size() > 80) said = said.substr(0, 60) + "...";
    throw InputError(nb::cast<std::string>(nb::handle(given.type()).attr("__name__")) + "." + name + " = " +
                     said + " is not of the kind that the field holds");
  }

  std::map<PyObject*, Material> materials_;
};

// The other way: `make` is called with the kind of a part and its fields.
class PartTeller {
 public:
  explicit PartTeller(nb::callable make) : make_(std::move(make)) {}

  template <Part T>
  nb::dict fields(const T& part) const {
    nb::dict out;
    std::apply([&](const auto&... field) { ((out[field.name] = told(part.*field.member)), ...); },
               detail::fields<T>);
    return out;
  }
  template <Part T>
  nb::object told(const T& part) const {
    return make_(std::get<PartName<T>>(parts).name, fields(part));
  }

 private:
  template <class E>
    requires std::is_enum_v<E>
  nb::object told(E value) const {
    for (const auto& [name, one] : detail::values_of<E>)
      if (one == value) return nb::str(name);
    return nb::none();
  }
  template <class T>
  nb::object told(const std::vector<T>& list) const {
    nb::list out;
    for (const T& one : list) out.append(told(one));
    return nb::tuple(out);
  }
  template <class T>
    requires(!Part<T> && !std::is_enum_v<T>)
  nb::object told(const T& value) const {
    return nb::cast(value);
  }

  nb::callable make_;
};

}  // namespace amontons::python
