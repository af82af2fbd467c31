// Programs: device source assembled at run time from embedded parts, and the cache of what was compiled.
//
// A program is: prelude of the language, what the kernel takes, then the kernel's file (kernels/entries/<name>.cl), in
// which every line
//   #include "name"
// is replaced by the text of that part, once. A part is looked up first among the program's modules (which is how a
// surface kind is linked into a generic kernel: `#include "surface"`), then among the embedded files, by its path from
// kernels/ (`#include "roots/bernstein.inc"`).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace smurf {

enum class KernelId {
#define KERNEL(name, shape, group, bindings) name,
#include "kernels/kernels.def"
#undef KERNEL
};

enum class KernelShape { lanes, scalar };

struct KernelArgument {
  enum class Kind { buffers, buffer, integer };
  Kind kind;
  std::string_view name;
};

struct KernelSpec {
  KernelId id;
  std::string_view name;
  KernelShape shape;
  int group;
  std::vector<KernelArgument> arguments;
};

const std::vector<KernelSpec>& kernel_specs();
const KernelSpec& spec_of(KernelId id);

// What to compile. Two equal programs give the same kernel.
struct Program {
  KernelId kernel;
  std::map<std::string, std::string> modules;  // name in #include -> text
  std::map<std::string, std::string> defines;
  std::map<std::string, std::vector<std::string>> groups = {};  // BUFFERS of the kernel -> the names of its buffers

  bool operator<(const Program& other) const;
};

// What a launch of the program is given, in order: all buffers, those of a group g as g_name, then all integers. Throws
// std::logic_error when a group of the kernel has no names.
struct Bindings {
  std::vector<std::string> buffers, integers;
};
Bindings bindings_of(const Program& program);

// Push constants that every Vulkan device has. What takes more finds the addresses of its buffers in a table.
constexpr std::size_t push_constant_bytes = 128;
inline bool takes_table(std::size_t buffers, std::size_t integers) {
  return 8 * buffers + 4 * integers > push_constant_bytes;
}

enum class Language { opencl, glsl };

// The complete source. `lanes` is ignored for GLSL and for kernels of scalar shape.
// LANES and GROUP (work items per work group) are defined for it.
std::string assemble(const Program& program, Language language, int lanes, int work_group);

// Text of an embedded file, named as under kernels/core ("roots/bernstein.inc"). Throws std::logic_error if there is
// none.
std::string_view kernel_source(std::string_view name);

// Compiled programs on disk, by content. The directory is $SMURF_CACHE, else $XDG_CACHE_HOME/smurf, else
// ~/.cache/smurf; SMURF_CACHE=off turns it off. Failures to read or write are not errors: the program is compiled
// again.
std::string content_key(std::string_view text, std::string_view compiler);
std::optional<std::vector<std::byte>> load_cached(const std::string& key);
void store_cached(const std::string& key, const void* data, std::size_t bytes);

// Writes an assembled program to $SMURF_DUMP/<kernel>-<key>.<extension> when SMURF_DUMP is set.
void dump_program(const Program& program, const std::string& source, const std::string& key,
                  std::string_view extension);

}  // namespace smurf
