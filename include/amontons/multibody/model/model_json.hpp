#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "amontons/multibody/model/description.hpp"

// Models as JSON (docs/files.md lists the fields): the one reader and the one writer, which Python calls too.
// By this route MJCF and URDF files, which Python reads, reach C++, and models that C++ made reach Python.
namespace amontons {

// The version of files that are written. A reader refuses a later one; a file without a version is of the
// first.
constexpr int model_json_version = 2;

// The description in the text; a Model made of it checks it. Throws InputError that begins with `who` and
// names the place: line and column if the text is not JSON, otherwise the field, as in
// geoms[3].material.friction.
ModelDescription read_model_json(std::string_view text, const std::string& who = "model");
// The same for a file.
ModelDescription read_model_file(const std::filesystem::path& file);

// The text that read_model_json and amontons.load_model read, in ASCII. Every number comes back exactly,
// infinity is the text "Infinity".
std::string write_model_json(const ModelDescription& description);
// Replaces the file, or throws InputError if it cannot be written. A file that was there then stays as it
// was: the text goes to a file beside it, which takes its name at the end.
void write_model_file(const ModelDescription& description, const std::filesystem::path& file);

}  // namespace amontons
