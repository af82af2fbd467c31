// What the device verbs have in common: opening the device, checking where the output goes, and the report of -v.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <string_view>

#include "cli/commands.hpp"
#include "smurf/device.hpp"
#include "smurf/error.hpp"
#include "smurf/flow.hpp"
#include "smurf/interrogator.hpp"

namespace smurf {

Device open(const DeviceChoice& choice, const CommonOptions& common);

// Does the work; what is wrong with the input is told with the name of the file that it comes from. (Of a stream
// surface much is known only when it is traced.)
template <class Work>
auto naming(const std::filesystem::path& file, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) throw;
    throw Error(error.code(), file.string() + ": " + error.what());
  }
}

// The surface of the file on the device; says how far it is where that takes long.
Interrogator prepare(const Device& device, const Surface& surface, const std::filesystem::path& file,
                     const CommonOptions& common);
// The same of a vector field.
Tracer prepare(const Device& device, const VectorField& field, const std::filesystem::path& file,
               const CommonOptions& common);

// Throws Error (usage) when the extension is none of `extensions` (".csv"), when the folder does not exist or
// when the path is a folder: known before the work begins, so that no work is lost.
void check_output(const std::filesystem::path& file, std::initializer_list<std::string_view> extensions);

// The extension in small letters.
std::string extension_of(const std::filesystem::path& file);

// The line, counted from 1, of a row of a CSV file, counted from 0. Readers pass over blank lines; the first other line
// is the header.
std::size_t line_of_row(const std::filesystem::path& file, std::size_t row);

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

// With -v, on standard error: the device, compiling, time per kernel, and the rate of `count` things (rays, points).
void report(const Device& device, const CommonOptions& common, std::string_view what, std::size_t count,
            double seconds);

// 1536 -> "1.5 KiB".
std::string bytes_text(std::size_t bytes);

}  // namespace smurf
