#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "amontons/multibody/model/description.hpp"

// Models as the JSON that the Python package writes (amontons.write_model, docs/files.md). By this route MJCF
// and URDF files, which Python reads, reach C++.
namespace amontons {

// The description in the text; a Model made of it checks it. Parts that only Python uses (keyframes, sites,
// sensors, visuals) are skipped. Throws InputError that begins with `who` and names the place: line and
// column if the text is not JSON, otherwise the field, as in geoms[3].material.friction.
ModelDescription read_model_json(std::string_view text, const std::string& who = "model");
// The same for a file.
ModelDescription read_model_file(const std::filesystem::path& file);

}  // namespace amontons
