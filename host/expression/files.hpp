// Implicit functions from files, of the variables x, y, z = 0, 1, 2.
//
// .jsurf: the descriptions of IMAGINARY's jsurf and SURFER, Java properties: surface_equation, and its constants as
// surface_parameter_a and so on. Colours, lights and the view are passed over. Products are written with *.
// .vm: fidget's tapes, one operation a line: a new name, an operation, names from above or a number. The last is the
// function.
//
// Errors name the file and the line. Files of more than 16 MiB are refused.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "expression/graph.hpp"

namespace smurf::expression {

struct ImplicitFile {
  Graph graph;
  NodeId root = 0;
  std::string title;           // a tape's first comment; else the file's name without folder and ending
  std::size_t operations = 0;  // a tape's lines; else what is reachable in the graph
};

constexpr std::size_t longest_file = std::size_t(16) << 20;

ImplicitFile load_jsurf(const std::filesystem::path& file);
ImplicitFile load_vm(const std::filesystem::path& file);

// The same of a text; `name` stands for the file in messages and the title.
ImplicitFile parse_jsurf(std::string_view text, const std::filesystem::path& name);
ImplicitFile parse_vm(std::string_view text, const std::filesystem::path& name);

}  // namespace smurf::expression
