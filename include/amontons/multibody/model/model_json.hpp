#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "amontons/multibody/model/description.hpp"

// Models as the JSON that the Python package writes (amontons.write_model, docs/files.md): so MJCF and URDF
// files, which Python reads, come to C++.
namespace amontons {

// What the text describes; a Model made of it checks it. Parts that only Python has (keyframes, sites,
// sensors, visuals) are passed over. Throws InputError that begins with `who` and names the place: where the
// text is no JSON, line and column, else the field, as geoms[3].material.friction.
ModelDescription read_model_json(std::string_view text, const std::string& who = "model");
// The same of a file.
ModelDescription read_model_file(const std::filesystem::path& file);

}  // namespace amontons
