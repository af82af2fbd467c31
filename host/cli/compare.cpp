// The verb `compare`: reconstructions of a sampled surface against the exact one, as tables on standard output and as a
// file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "cli/commands.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "cli/session.hpp"
#include "io/result_table.hpp"
#include "smurf/compare.hpp"
#include "smurf/error.hpp"

namespace smurf {

namespace {

struct NamedMeasure {
  std::string_view name;
  ErrorMeasure ComparisonRow::*measure;
};

constexpr NamedMeasure named_measures[] = {
    {"location", &ComparisonRow::location}, {"normal", &ComparisonRow::normal},     {"mean", &ComparisonRow::mean},
    {"gauss", &ComparisonRow::gauss},       {"chord", &ComparisonRow::along_chord},
};

struct NamedCount {
  std::string_view name;
  std::size_t ComparisonRow::*count;
};

constexpr NamedCount named_counts[] = {
    {"missed", &ComparisonRow::missed},       {"invented", &ComparisonRow::invented},
    {"undecided", &ComparisonRow::undecided}, {"lost", &ComparisonRow::lost},
    {"undefined", &ComparisonRow::undefined}, {"not_finite", &ComparisonRow::not_finite},
};

std::string error_text(double error) { return std::isnan(error) ? "-" : fmt::format("{:.1e}", error); }

std::string measure_text(const ErrorMeasure& measure) {
  const std::string order = std::isnan(measure.order) ? "-" : fmt::format("{:.2f}", measure.order);
  return fmt::format("{:>9} {:>5} {:>8}", error_text(measure.rms), order, error_text(measure.greatest));
}

std::string row_name(const ComparisonRow& row) {
  return fmt::format("{:<14} {:>5}", name_of(row.reconstruction), row.resolution);
}

void print_surface_errors(const Comparison& comparison) {
  fmt::print("{:<20} {:>5} {:>9}", "", "", "");
  for (const char* title : {"location", "normal, rad", "mean curvature", "Gauss curvature"})
    fmt::print("  {:^24}", title);
  fmt::print("\n{:<14} {:>5} {:>5} {:>9}", "reconstruction", "nodes", "lost", "undefined");
  for (int i = 0; i < 4; i++) fmt::print("  {:>9} {:>5} {:>8}", "rms", "order", "greatest");
  fmt::print("\n");
  for (const ComparisonRow& row : comparison.rows) {
    fmt::print("{} {:>5} {:>9}", row_name(row), row.lost, row.undefined);
    for (const ErrorMeasure& measure : {row.location, row.normal, row.mean, row.gauss})
      fmt::print("  {}", measure_text(measure));
    fmt::print("\n");
  }
}

void print_roots(const Comparison& comparison) {
  fmt::print("{:<14} {:>5} {:>7} {:>9} {:>10}  {:>9} {:>5} {:>8}\n", "reconstruction", "nodes", "missed", "invented",
             "undecided", "rms", "order", "greatest");
  for (const ComparisonRow& row : comparison.rows) {
    fmt::print("{} {:>7} {:>9} {:>10}  {}\n", row_name(row), row.missed, row.invented, row.undecided,
               measure_text(row.along_chord));
  }
}

void print_legend(const Comparison& c) {
  fmt::print(
      "\nnodes: along each axis of the domain; the grid has {} more beyond each face. location: distance of the "
      "surfaces, in "
      "world units.\n"
      "Curvatures: absolute errors; the exact surface has mean {:.3g}, Gauss {:.3g} (rms). order: the power of the "
      "step by which "
      "the rms error fell\n"
      "from the resolution before, until the rounding of samples and answers, which are floats, ends it.\n"
      "lost: points without a reconstructed surface within {:.3g}; undefined: points where it has no normal or "
      "curvature.\n"
      "missed, invented: exact roots that the reconstruction lacks, or has alone; undecided: those of hits that are "
      "flagged.\n"
      "Left out: {} roots nearer than {:.3g} to the border of the domain, and {} points where the surface is singular "
      "or just "
      "touched.\n",
      c.apron, c.mean_rms, c.gauss_rms, c.reach, c.near_boundary, c.margin, c.singular);
  for (const ComparisonRow& row : c.rows) {
    if (row.reconstruction == c.rows.front().reconstruction && row.not_finite > 0)
      fmt::print("At {} nodes {} samples are not finite: there is no surface within their reach.\n", row.resolution,
                 row.not_finite);
  }
}

void print_comparison(const Comparison& c) {
  fmt::print(
      "At {} points of the exact surface, spread evenly over it: where its normal's line meets the reconstructed "
      "surface.\n",
      c.points);
  print_surface_errors(c);
  fmt::print("\nAlong {} random chords of the domain, with {} exact roots:\n", c.rays, c.roots);
  print_roots(c);
  print_legend(c);
}

void write_comparison(const Comparison& comparison, const std::filesystem::path& file) {
  const auto column = [&](auto of_row) {
    std::vector<decltype(of_row(comparison.rows.front()))> values;
    for (const ComparisonRow& row : comparison.rows) values.push_back(of_row(row));
    return values;
  };
  const std::vector<std::string_view> reconstructions =
      column([](const auto& row) { return name_of(row.reconstruction); });
  const std::vector<std::uint64_t> resolutions = column([](const auto& row) { return std::uint64_t(row.resolution); });
  const std::vector<float> steps = column([](const auto& row) { return float(row.step); });
  Table table;
  table.add("reconstruction", reconstructions);
  table.add("resolution", resolutions);
  table.add("step", steps);

  std::vector<std::vector<float>> numbers;  // the table shows these; growing moves vectors, not what they hold
  std::vector<std::vector<std::uint64_t>> counts;
  const auto add_number = [&](const std::string& name, auto of_row) {
    table.add(name, numbers.emplace_back(column([&](const auto& row) { return float(of_row(row)); })));
  };
  const auto add_count = [&](std::string_view name, auto of_row) {
    table.add(name, counts.emplace_back(column([&](const auto& row) { return std::uint64_t(of_row(row)); })));
  };
  add_count("points", [&](const auto&) { return comparison.points; });
  add_count("roots", [&](const auto&) { return comparison.roots; });
  for (const NamedCount& named : named_counts) add_count(named.name, [&](const auto& row) { return row.*named.count; });
  for (const NamedMeasure& named : named_measures) {
    const std::string name(named.name);
    add_number(name + "_rms", [&](const auto& row) { return (row.*named.measure).rms; });
    add_number(name + "_max", [&](const auto& row) { return (row.*named.measure).greatest; });
    add_number(name + "_order", [&](const auto& row) { return (row.*named.measure).order; });
  }
  add_number("exact_mean_rms", [&](const auto&) { return comparison.mean_rms; });
  add_number("exact_gauss_rms", [&](const auto&) { return comparison.gauss_rms; });
  add_number("margin", [&](const auto&) { return comparison.margin; });
  write_table(table, file);
}

}  // namespace

void run_compare(const CompareCommand& command, const CommonOptions& common) {
  if (!command.output.empty()) check_output(command.output, {".csv"});
  const auto resolutions = numbers_in<int>(command.resolutions);
  if (!resolutions) {
    throw Error(ErrorCode::usage,
                fmt::format("--resolutions takes integers with commas between them, as 16,32,64, not \"{}\"",
                            command.resolutions));
  }
  const Surface surface = load_surface(command.surface);
  const Device device = open(command.device, common);

  Comparison comparison;
  try {
    Progress progress("comparing", common.quiet);
    comparison = compare(device, surface,
                         {.resolutions = *resolutions,
                          .rays = command.rays,
                          .seed = command.seed,
                          .apron = command.apron,
                          .margin = command.margin,
                          .progress = progress.callback()});
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) throw;
    throw Error(error.code(), fmt::format("{}: {}", command.surface.string(), error.what()));
  }
  if (!command.output.empty()) write_comparison(comparison, command.output);
  print_comparison(comparison);
  report(device, common, "rays", comparison.device_rays, comparison.device_seconds);
}

}  // namespace smurf
