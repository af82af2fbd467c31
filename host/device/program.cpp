// Assembles device programs from the embedded sources, and keeps what was compiled on disk.
//
// Assembly is text replacement: a line  #include "name"  gives way to that part, the first time it is met.
// A cached file is a header (magic, length, hash) and the compiler's bytes; whatever does not agree with
// its header is treated as absent.
#include "device/program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <tuple>

#include "device/embedded_sources.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;

std::optional<std::string_view> find_embedded(std::string_view name) {
  for (const EmbeddedSource& source : embedded_sources()) {
    if (source.name == name) return source.text;
  }
  return std::nullopt;
}

std::string_view embedded(std::string_view name) {
  const auto text = find_embedded(name);
  if (!text) throw std::logic_error(fmt::format("no device source \"{}\" is embedded in the library", name));
  return *text;
}

// The name in a line  #include "name", empty for every other line.
std::string_view included_name(std::string_view line) {
  const auto skip_blanks = [&line] { line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size())); };
  skip_blanks();
  if (!line.starts_with('#')) return {};
  line.remove_prefix(1);
  skip_blanks();
  if (!line.starts_with("include")) return {};
  line.remove_prefix(std::string_view("include").size());
  skip_blanks();
  if (!line.starts_with('"')) return {};
  line.remove_prefix(1);
  const auto end = line.find('"');
  return end == std::string_view::npos ? std::string_view{} : line.substr(0, end);
}

class Assembler {
 public:
  explicit Assembler(const Program& program) : program_(program) {}

  void append(std::string_view text, std::string_view origin) {
    while (!text.empty()) {
      const auto end = text.find('\n');
      const std::string_view line = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      const std::string_view name = included_name(line);
      if (name.empty()) {
        source.append(line).push_back('\n');
      } else if (included_.emplace(name).second) {
        append(part(name, origin), name);
      }
    }
  }

  std::string source;

 private:
  std::string_view part(std::string_view name, std::string_view origin) const {
    if (const auto module = program_.modules.find(std::string(name)); module != program_.modules.end()) {
      return module->second;
    }
    const auto text = find_embedded(fmt::format("kernels/{}", name));
    if (!text) {
      throw std::logic_error(
          fmt::format("\"{}\" includes \"{}\", which is neither a module of the program for {} nor a file of kernels/",
                      origin, name, spec_of(program_.kernel).name));
    }
    return *text;
  }

  const Program& program_;
  std::set<std::string, std::less<>> included_;
};

// Two hashes of different structure, so that together they are as good as one of 128 bits here.
std::uint64_t hash_fnv(std::string_view text, std::uint64_t state = 0xcbf29ce484222325u) {
  for (const char c : text) state = (state ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return state;
}

std::uint64_t hash_rotating(std::string_view text, std::uint64_t state = 0x243f6a8885a308d3u) {
  for (const char c : text) {
    state += static_cast<unsigned char>(c) + 0x9e3779b97f4a7c15u;
    state = ((state << 29) | (state >> 35)) * 0xd6e8feb86659fd93u;
  }
  state ^= state >> 32;
  state *= 0xd6e8feb86659fd93u;
  return state ^ (state >> 32);
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::optional<fs::path> cache_directory() {
  const std::string own = environment("SMURF_CACHE");
  if (own == "off") return std::nullopt;
  if (!own.empty()) return own;
  if (const std::string xdg = environment("XDG_CACHE_HOME"); !xdg.empty()) return fs::path(xdg) / "smurf";
  if (const std::string home = environment("HOME"); !home.empty()) return fs::path(home) / ".cache" / "smurf";
  return std::nullopt;
}

fs::path cache_file(const fs::path& directory, const std::string& key) { return directory / (key + ".bin"); }

struct CacheHeader {
  char magic[8];
  std::uint64_t bytes;
  std::uint64_t hash;
};
static_assert(sizeof(CacheHeader) == 24);
constexpr char cache_magic[8] = {'s', 'm', 'u', 'r', 'f', '0', '0', '1'};

}  // namespace

const std::vector<KernelSpec>& kernel_specs() {
  static const std::vector<KernelSpec> specs = {
#define KERNEL(name, shape, group, bindings) {KernelId::name, #name, KernelShape::shape, group, {bindings}},
#define BUFFERS(name) {KernelArgument::Kind::buffers, #name},
#define BUFFER(name) {KernelArgument::Kind::buffer, #name},
#define INTEGER(name) {KernelArgument::Kind::integer, #name},
#include "kernels/kernels.def"
#undef KERNEL
#undef BUFFERS
#undef BUFFER
#undef INTEGER
  };
  return specs;
}

const KernelSpec& spec_of(KernelId id) { return kernel_specs().at(static_cast<std::size_t>(id)); }

bool Program::operator<(const Program& other) const {
  return std::tie(kernel, defines, groups, modules) <
         std::tie(other.kernel, other.defines, other.groups, other.modules);
}

Bindings bindings_of(const Program& program) {
  const KernelSpec& spec = spec_of(program.kernel);
  Bindings bindings;
  for (const KernelArgument& argument : spec.arguments) {
    const std::string name(argument.name);
    if (argument.kind == KernelArgument::Kind::integer) bindings.integers.push_back(name);
    if (argument.kind == KernelArgument::Kind::buffer) bindings.buffers.push_back(name);
    if (argument.kind != KernelArgument::Kind::buffers) continue;
    const auto group = program.groups.find(name);
    if (group == program.groups.end() || group->second.empty()) {
      throw std::logic_error(fmt::format(
          "kernel {} takes the buffers of a group \"{}\", which the program does not name", spec.name, name));
    }
    for (const std::string& buffer : group->second) bindings.buffers.push_back(fmt::format("{}_{}", name, buffer));
  }
  return bindings;
}

namespace {

std::string list_of(const Bindings& bindings, std::string_view before_buffer, std::string_view before_integer,
                    std::string_view after, std::string_view between) {
  std::string text;
  const auto add = [&](std::string_view before, const std::string& name) {
    text += fmt::format("{}{}{}{}", text.empty() ? "" : between, before, name, after);
  };
  for (const std::string& name : bindings.buffers) add(before_buffer, name);
  for (const std::string& name : bindings.integers) add(before_integer, name);
  return text;
}

// What the macro KERNEL of the preludes is made of: the kernel's parameters, and in GLSL the push constants' members
// and how these are handed on.
std::string argument_macros(const Bindings& bindings, Language language) {
  std::string text = fmt::format("#define KERNEL_PARAMETERS {}\n", list_of(bindings, "Buffer ", "int ", "", ", "));
  if (language == Language::opencl) return text;
  const bool table = takes_table(bindings.buffers.size(), bindings.integers.size());
  if (table) {
    text += fmt::format("#define KERNEL_MEMBERS KernelTable table; {}\n",
                        list_of({{}, bindings.integers}, "", "int ", ";", " "));
    text += fmt::format("#define KERNEL_VALUES {}\n", list_of(bindings, "arguments.table.", "arguments.", "", ", "));
  } else {
    text += fmt::format("#define KERNEL_MEMBERS {}\n", list_of(bindings, "Buffer ", "int ", ";", " "));
    text += fmt::format("#define KERNEL_VALUES {}\n", list_of(bindings, "arguments.", "arguments.", "", ", "));
  }
  return text;
}

// The types of the kernel's arguments, which need the prelude's: of a group g of buffers a struct GBuffers, which
// g_buffers() makes within the kernel.
std::string argument_types(const Program& program, const Bindings& bindings, Language language) {
  std::string text;
  if (language == Language::glsl && takes_table(bindings.buffers.size(), bindings.integers.size())) {
    text += fmt::format("layout(buffer_reference, std430, buffer_reference_align = 8) buffer KernelTable {{ {} }};\n",
                        list_of({bindings.buffers, {}}, "Buffer ", "", ";", " "));
  }
  for (const KernelArgument& argument : spec_of(program.kernel).arguments) {
    if (argument.kind != KernelArgument::Kind::buffers) continue;
    const std::string group(argument.name);
    std::string type = group + "Buffers";
    type[0] = char(std::toupper(static_cast<unsigned char>(type[0])));
    const std::vector<std::string>& names = program.groups.at(group);
    text += fmt::format("STRUCT({0}) {{ Buffer {1}; }};\nFN {0} {2}_buffers_of(Buffer {3}) {{\n  {0} buffers;\n", type,
                        fmt::join(names, "; Buffer "), group, fmt::join(names, ", Buffer "));
    for (const std::string& name : names) text += fmt::format("  buffers.{0} = {0};\n", name);
    text += fmt::format("  return buffers;\n}}\n#define {0}_buffers() {0}_buffers_of({0}_{1})\n", group,
                        fmt::join(names, fmt::format(", {}_", group)));
  }
  return text;
}

// kernels/entries/<name>.cl, or that in a folder there.
std::string entry_file(std::string_view kernel) {
  const std::string end = fmt::format("/{}.cl", kernel);
  for (const EmbeddedSource& source : embedded_sources()) {
    if (source.name.starts_with("kernels/entries/") && source.name.ends_with(end)) return std::string(source.name);
  }
  return "kernels/entries" + end;
}

}  // namespace

std::string assemble(const Program& program, Language language, int lanes, int work_group) {
  const KernelSpec& spec = spec_of(program.kernel);
  const bool glsl = language == Language::glsl;
  const bool in_lanes = !glsl && spec.shape == KernelShape::lanes;
  const std::string prelude = glsl ? "shaders/prelude.glsl" : "kernels/prelude.cl";
  const std::string entry = entry_file(spec.name);
  const Bindings bindings = bindings_of(program);

  Assembler assembler(program);
  if (glsl) assembler.source += "#version 450\n";  // must be the first line
  assembler.source += fmt::format("#define LANES {}\n#define GROUP {}\n", in_lanes ? lanes : 1, work_group);
  for (const auto& [name, value] : program.defines) assembler.source += fmt::format("#define {} {}\n", name, value);
  assembler.source += argument_macros(bindings, language);
  assembler.append(embedded(prelude), prelude);
  assembler.source += argument_types(program, bindings, language);
  assembler.append(embedded(entry), entry);
  return std::move(assembler.source);
}

std::string_view kernel_source(std::string_view name) { return embedded(fmt::format("kernels/{}", name)); }

std::string content_key(std::string_view text, std::string_view compiler) {
  // The length keeps ("ab", "c") and ("a", "bc") apart.
  const std::string length = fmt::format("{}:", text.size());
  const auto first = hash_fnv(compiler, hash_fnv(text, hash_fnv(length)));
  const auto second = hash_rotating(compiler, hash_rotating(text, hash_rotating(length)));
  return fmt::format("{:016x}{:016x}", first, second);
}

std::optional<std::vector<std::byte>> load_cached(const std::string& key) {
  try {
    const auto directory = cache_directory();
    if (!directory) return std::nullopt;
    std::ifstream file(cache_file(*directory, key), std::ios::binary | std::ios::ate);
    if (!file) return std::nullopt;
    const std::streamoff size = file.tellg();
    CacheHeader header{};
    if (size < static_cast<std::streamoff>(sizeof header)) return std::nullopt;
    file.seekg(0);
    file.read(reinterpret_cast<char*>(&header), sizeof header);
    if (!file || std::memcmp(header.magic, cache_magic, sizeof cache_magic) != 0) return std::nullopt;
    if (header.bytes != static_cast<std::uint64_t>(size) - sizeof header) return std::nullopt;
    std::vector<std::byte> data(header.bytes);
    char* bytes = reinterpret_cast<char*>(data.data());
    file.read(bytes, static_cast<std::streamsize>(data.size()));
    if (!file || hash_rotating({bytes, data.size()}) != header.hash) return std::nullopt;
    return data;
  } catch (const std::exception&) {
    return std::nullopt;  // as if it had not been there
  }
}

void store_cached(const std::string& key, const void* data, std::size_t bytes) {
  try {
    const auto directory = cache_directory();
    if (!directory) return;
    fs::create_directories(*directory);
    // Written under a name of its own and renamed: other processes see all of it or nothing.
    static std::atomic<unsigned> counter{0};
    const fs::path temporary = *directory / fmt::format("{}.{}.{}.tmp", key, ::getpid(), counter++);
    CacheHeader header{{}, bytes, hash_rotating({static_cast<const char*>(data), bytes})};
    std::memcpy(header.magic, cache_magic, sizeof cache_magic);
    std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(&header), sizeof header);
    file.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
    file.close();
    std::error_code failure;
    if (file) fs::rename(temporary, cache_file(*directory, key), failure);
    if (!file || failure) fs::remove(temporary, failure);
  } catch (const std::exception&) {
    // A cache that cannot be written costs time only.
  }
}

void dump_program(const Program& program, const std::string& source, const std::string& key,
                  std::string_view extension) {
  const fs::path directory = environment("SMURF_DUMP");
  if (directory.empty()) return;
  std::error_code failure;
  fs::create_directories(directory, failure);
  const fs::path path = directory / fmt::format("{}-{}.{}", spec_of(program.kernel).name, key, extension);
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << source;
  file.close();
  if (!file) throw Error(ErrorCode::io, fmt::format("SMURF_DUMP: cannot write \"{}\"", path.string()));
}

}  // namespace smurf
