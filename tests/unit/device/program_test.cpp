// Assembly of device programs from embedded parts, and the cache of compiled ones on disk.
#include "device/program.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "device/embedded_sources.hpp"
#include "device/executor.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;

// A program whose surface is the given text. The entry includes "surface", as every entry of a generic kernel does.
Program with_surface(std::string text, std::map<std::string, std::string> others = {}) {
  Program program{KernelId::find_hits, std::move(others), {}, {{"surface", {"uniforms"}}}};
  program.modules["surface"] = std::move(text);
  return program;
}

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) count++;
  return count;
}

bool embeds(const std::string& name) {
  for (const EmbeddedSource& source : embedded_sources()) {
    if (source.name == name) return true;
  }
  return false;
}

TEST(KernelSpecs, StandInTheOrderOfTheirIds) {
  const auto& specs = kernel_specs();
  ASSERT_FALSE(specs.empty());
  for (std::size_t i = 0; i < specs.size(); i++) {
    EXPECT_EQ(static_cast<std::size_t>(specs[i].id), i);
    EXPECT_EQ(&spec_of(specs[i].id), &specs[i]);
    EXPECT_GT(specs[i].group, 0) << specs[i].name;
  }
}

TEST(KernelSpecs, NameTheirBindings) {
  const KernelSpec& spec = spec_of(KernelId::count_blocks);
  EXPECT_EQ(spec.name, "count_blocks");
  EXPECT_EQ(spec.shape, KernelShape::scalar);
  const Bindings bindings = bindings_of({KernelId::count_blocks, {}, {}});
  EXPECT_EQ(bindings.buffers, (std::vector<std::string>{"counts", "blocks"}));
  EXPECT_EQ(bindings.integers, (std::vector<std::string>{"count", "block"}));
}

TEST(KernelSpecs, TakeGroupsOfBuffersByTheNamesOfTheProgram) {
  Program program{KernelId::find_nearest, {{"surface", "marker_surface"}}, {}};
  EXPECT_THROW(bindings_of(program), std::logic_error);
  program.groups["surface"] = {"knots", "weights"};
  EXPECT_EQ(bindings_of(program).buffers,
            (std::vector<std::string>{"surface_knots", "surface_weights", "points", "coordinates"}));
  for (const Language language : {Language::opencl, Language::glsl}) {
    const std::string source = assemble(program, language, 1, 64);
    EXPECT_EQ(occurrences(source, "STRUCT(SurfaceBuffers) { Buffer knots; Buffer weights; };"), 1u);
    EXPECT_EQ(occurrences(source, "#define surface_buffers() surface_buffers_of(surface_knots, surface_weights)"), 1u);
  }
  // What a launch gives must be what the program names, in that order.
  std::vector<DeviceBuffer*> buffers;
  append_group(program, "surface", {{"knots"}, {"weights"}}, buffers);
  EXPECT_EQ(buffers.size(), 2u);
  EXPECT_THROW(append_group(program, "surface", {{"weights"}, {"knots"}}, buffers), std::logic_error);
  EXPECT_THROW(append_group(program, "surface", {{"knots"}}, buffers), std::logic_error);
  EXPECT_THROW(append_group(program, "row", {{"t"}}, buffers), std::logic_error);
}

TEST(KernelSpecs, FindTheAddressesOfManyBuffersInATable) {
  Program program{KernelId::find_nearest, {{"surface", ""}}, {}};
  for (int i = 0; i < 13; i++) program.groups["surface"].push_back("part" + std::to_string(i));
  EXPECT_EQ(occurrences(assemble(program, Language::glsl, 1, 64), "KernelTable"), 0u)
      << "15 buffers and 2 integers fit";
  program.groups["surface"].push_back("part13");
  EXPECT_GT(occurrences(assemble(program, Language::glsl, 1, 64), "KernelTable"), 0u);
  EXPECT_EQ(occurrences(assemble(program, Language::opencl, 1, 64), "KernelTable"), 0u);
}

TEST(KernelSpecs, HaveAFile) {
  for (const KernelSpec& spec : kernel_specs()) {
    const std::string file = std::string(spec.name) + ".cl";
    EXPECT_TRUE(embeds("kernels/entries/" + file) || embeds("kernels/entries/mesh/" + file)) << spec.name;
  }
}

TEST(Assemble, DefinesLanesGroupAndTheProgramsOwn) {
  Program program = with_surface("");
  program.defines["ANSWER"] = "42";
  const std::string source = assemble(program, Language::opencl, 8, 16);
  EXPECT_TRUE(source.starts_with("#define LANES 8\n#define GROUP 16\n#define ANSWER 42\n")) << source.substr(0, 200);
}

TEST(Assemble, IgnoresLanesForScalarKernelsAndForGlsl) {
  const Program scalar{KernelId::count_blocks, {}, {}};
  EXPECT_TRUE(assemble(scalar, Language::opencl, 8, 64).starts_with("#define LANES 1\n#define GROUP 64\n"));
  EXPECT_TRUE(assemble(with_surface(""), Language::glsl, 8, 128)
                  .starts_with("#version 450\n#define LANES 1\n#define GROUP 128\n"));
}

TEST(Assemble, IncludesEachPartOnce) {
  const std::string source =
      assemble(with_surface("#include \"a\"\n  # include \"b\" // again\n#include \"a\"\nafter_surface\n",
                            {{"a", "#include \"common\"\nmarker_a"},
                             {"b", "#include \"common\"\n#include \"surface\"\nmarker_b\n"},
                             {"common", "marker_common\n"}}),
               Language::opencl, 4, 32);
  EXPECT_EQ(occurrences(source, "marker_common\nmarker_a\nmarker_b\nafter_surface\n"), 1u);
  for (const char* marker : {"marker_common", "marker_a", "marker_b", "after_surface"}) {
    EXPECT_EQ(occurrences(source, marker), 1u) << marker;
  }
  EXPECT_EQ(occurrences(source, "#include"), 0u);
}

TEST(Assemble, PrefersModulesToCoreFiles) {
  const Program program =
      with_surface("#include \"roots/bernstein.inc\"\n", {{"roots/bernstein.inc", "a_module_instead\n"}});
  EXPECT_EQ(occurrences(assemble(program, Language::opencl, 1, 128), "a_module_instead"), 1u);
}

TEST(Assemble, NamesAnUnknownInclude) {
  try {
    assemble(with_surface("#include \"nonesuch.inc\"\n"), Language::opencl, 1, 128);
    FAIL() << "an unknown include was accepted";
  } catch (const std::logic_error& error) {
    EXPECT_NE(std::string(error.what()).find("nonesuch.inc"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("surface"), std::string::npos) << error.what();
  }
}

TEST(KernelSource, IsFoundByNameOrNamedInTheError) {
  EXPECT_FALSE(kernel_source("roots/bernstein.inc").empty());
  EXPECT_THROW(kernel_source("nonesuch.inc"), std::logic_error);
}

TEST(ProgramOrder, TellsProgramsApart) {
  const Program a = with_surface("a");
  const Program b = with_surface("b");
  Program c = a;
  c.defines["X"] = "1";
  EXPECT_EQ((std::set<Program>{a, b, c, a, b, c, {KernelId::count_blocks, {}, {}}}.size()), 4u);
}

TEST(ContentKey, DependsOnTextAndCompilerSeparately) {
  const std::string key = content_key("ab", "c");
  EXPECT_EQ(key.size(), 32u);
  EXPECT_EQ(key.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_EQ(key, content_key("ab", "c"));
  EXPECT_EQ((std::set<std::string>{key, content_key("a", "bc"), content_key("abc", ""), content_key("", "abc"),
                                   content_key("ac", "b")}
                 .size()),
            5u);
}

// A cache of its own, in a directory that does not exist yet.
class Cache : public testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/smurf-cache-XXXXXX";
    ASSERT_NE(::mkdtemp(name), nullptr);
    root_ = name;
    if (const char* before = ::getenv("SMURF_CACHE")) before_ = before;
    use((root_ / "deep" / "cache").string());
  }
  void TearDown() override {
    if (before_) {
      use(*before_);
    } else {
      ::unsetenv("SMURF_CACHE");
    }
    fs::remove_all(root_);
  }
  void use(const std::string& directory) { ::setenv("SMURF_CACHE", directory.c_str(), 1); }
  std::vector<fs::path> files() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(root_)) {
      if (entry.is_regular_file()) found.push_back(entry.path());
    }
    return found;
  }

  fs::path root_;
  std::optional<std::string> before_;
  std::string key_ = content_key("source", "compiler");
  std::vector<std::byte> data_{std::byte{1}, std::byte{0}, std::byte{255}, std::byte{7}};
};

TEST_F(Cache, GivesBackWhatWasStored) {
  EXPECT_FALSE(load_cached(key_));
  store_cached(key_, data_.data(), data_.size());
  EXPECT_EQ(load_cached(key_), data_);
  EXPECT_EQ(files().size(), 1u) << "temporary files are left";
  data_.push_back(std::byte{9});
  store_cached(key_, data_.data(), data_.size());
  EXPECT_EQ(load_cached(key_), data_);
  EXPECT_FALSE(load_cached(content_key("other", "compiler")));
}

TEST_F(Cache, IgnoresATruncatedFile) {
  store_cached(key_, data_.data(), data_.size());
  const fs::path file = files().at(0);
  for (auto size = fs::file_size(file); size-- > 0;) {
    fs::resize_file(file, size);
    EXPECT_FALSE(load_cached(key_)) << "cut to " << size << " bytes";
  }
}

TEST_F(Cache, IgnoresDamagedBytes) {
  store_cached(key_, data_.data(), data_.size());
  const fs::path path = files().at(0);
  const auto size = static_cast<std::streamoff>(fs::file_size(path));
  for (std::streamoff at = 0; at < size; at++) {
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    file.seekg(at);
    const char old = static_cast<char>(file.get());
    file.seekp(at);
    file.put(static_cast<char>(old ^ 0x10));
    file.flush();
    EXPECT_FALSE(load_cached(key_)) << "byte " << at;
    file.seekp(at);
    file.put(old);
  }
  EXPECT_EQ(load_cached(key_), data_);
}

TEST_F(Cache, CanBeOffOrImpossible) {
  use("off");
  store_cached(key_, data_.data(), data_.size());
  EXPECT_FALSE(load_cached(key_));
  std::ofstream(root_ / "file") << "in the way";
  use((root_ / "file" / "cache").string());
  EXPECT_NO_THROW(store_cached(key_, data_.data(), data_.size()));
  EXPECT_FALSE(load_cached(key_));
}

TEST_F(Cache, DumpsProgramsOnRequest) {
  const Program program{KernelId::count_blocks, {}, {}};
  ::setenv("SMURF_DUMP", (root_ / "dump").c_str(), 1);
  dump_program(program, "the source", "0123", "cl");
  ::unsetenv("SMURF_DUMP");
  std::ifstream file(root_ / "dump" / "count_blocks-0123.cl");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "the source");
}

}  // namespace
}  // namespace smurf
