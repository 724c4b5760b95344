#pragma once
#include <array>
#include <tuple>
#include <type_traits>

// Tables of the fields of plain structs and of the values of enumerations, by name. A table stands below the
// struct. Files and bindings are written in terms of tables, so that a new field is named once. They are the
// reader and the writer of models, and those of the parts of Python (bindings/parts.hpp). A field that no
// table names stays in C++.
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

// AMONTONS_FIELDS(Body, name, mass) is the table of two fields of Body, AMONTONS_VALUES(Kind, hinge, slide)
// that of an enumeration whose values have their names in C++. Both stand in this namespace. The macro of
// each entry puts the rest of the list behind itself, which the preprocessor expands in the next of 64 scans.
#define AMONTONS_FIELDS(T, ...)     \
  template <>                       \
  inline constexpr auto fields<T> = \
      std::tuple(AMONTONS_SCANS(AMONTONS_EACH(AMONTONS_FIELD, T, __VA_ARGS__)))
#define AMONTONS_VALUES(T, ...)                                   \
  template <>                                                     \
  inline constexpr auto values_of<T> = std::array {               \
    AMONTONS_SCANS(AMONTONS_EACH(AMONTONS_VALUE, T, __VA_ARGS__)) \
  }
#define AMONTONS_FIELD(T, x) \
  Field { #x, &T::x }
#define AMONTONS_VALUE(T, x) \
  Named { #x, T::x }
#define AMONTONS_EACH(what, T, x, ...) \
  what(T, x) __VA_OPT__(, AMONTONS_NEXT AMONTONS_PARENTHESES(what, T, __VA_ARGS__))
#define AMONTONS_PARENTHESES ()
#define AMONTONS_NEXT() AMONTONS_EACH
#define AMONTONS_SCANS(...) AMONTONS_SCANS4(AMONTONS_SCANS4(AMONTONS_SCANS4(AMONTONS_SCANS4(__VA_ARGS__))))
#define AMONTONS_SCANS4(...) AMONTONS_SCANS3(AMONTONS_SCANS3(AMONTONS_SCANS3(AMONTONS_SCANS3(__VA_ARGS__))))
#define AMONTONS_SCANS3(...) AMONTONS_SCAN(AMONTONS_SCAN(AMONTONS_SCAN(AMONTONS_SCAN(__VA_ARGS__))))
#define AMONTONS_SCAN(...) __VA_ARGS__

}  // namespace amontons::detail
