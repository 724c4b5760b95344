#pragma once
#include <string>
#include <string_view>

#include "amontons/base/error.hpp"
#include "amontons/multibody/model/description.hpp"

namespace amontons {

// Reference to a part of a model by index or by name; for bodies "world" is the world.
class Reference {
 public:
  Reference(Index index) : index_(index) {}
  Reference(const char* name) : name_(name), is_name_(true) {}
  Reference(std::string_view name) : name_(name), is_name_(true) {}
  Reference(const std::string& name) : name_(name), is_name_(true) {}

  // The index among `parts`; a name is looked up, an index is checked. Throws InputError naming the kind of
  // part, the given name or index, and the known ones.
  template <class Parts>
  Index among(const Parts& parts, const char* kind) const {
    for (std::size_t i = 0; is_name_ && i < parts.size(); ++i)
      if (parts[i].name == name_) return static_cast<Index>(i);
    if (!is_name_ && index_ >= 0 && static_cast<std::size_t>(index_) < parts.size()) return index_;
    std::string known;
    for (std::size_t i = 0; i < parts.size() && i < 20; ++i)
      known += (i ? ", " : "") + std::string(parts[i].name);
    if (parts.size() > 20) known += ", ...";
    throw InputError(std::string("there is no ") + kind + " " +
                     (is_name_ ? '"' + std::string(name_) + '"' : std::to_string(index_)) +
                     (parts.size() == 0 ? "; the model has none"
                      : is_name_        ? "; known are " + known
                                        : "; the model has " + std::to_string(parts.size()) + ", from 0"));
  }
  // The same for bodies, where the world is allowed.
  Index body_among(const std::vector<Body>& bodies) const {
    return (is_name_ ? name_ == "world" : index_ == world) ? world : among(bodies, "body");
  }

 private:
  Index index_ = world;
  std::string_view name_;
  bool is_name_ = false;
};

}  // namespace amontons
