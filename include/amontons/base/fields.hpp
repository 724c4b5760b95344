#pragma once
#include <array>
#include <tuple>
#include <type_traits>

// Tables of the fields of plain structs and of the values of enumerations, by name. A table stands below the
// struct. Files and bindings are written in terms of tables, so that a new field is named once. They are the
// reader and the writer of models and the classes of the compiled module. Python converts its parts by these
// names (model/compiled.py). A field that no table names stays in C++.
namespace amontons::detail {

template <class Owner, class Value>
struct Field {
  const char* name;
  Value Owner::* member;
};
// Compilers before 2023 deduce no arguments of aggregates.
template <class Owner, class Value>
Field(const char*, Value Owner::*) -> Field<Owner, Value>;

// fields<T> is a tuple of the Field of T, for every T that has a table.
template <class T>
inline constexpr auto fields = 0;
template <class T>
concept Described = !std::is_same_v<decltype(fields<T>), const int>;

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

}  // namespace amontons::detail
