// The verb `compare`: reconstructions of a sampled surface against the exact one, or ways to the normals and curvature
// of a stream surface; as tables on standard output and as a file.
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

void print_comparison(const StreamComparison& c) {
  fmt::print("At {} hits of {} random chords with the mesh, {} of them sampled, against integrated derivatives:\n",
             c.hits, c.rays, c.sampled);
  fmt::print("{:<12} {:>9} {:>5}", "", "", "");
  for (const char* title : {"normal, rad", "mean curvature", "Gauss curvature"}) fmt::print("  {:^18}", title);
  fmt::print("\n{:<12} {:>9} {:>5}", "derivatives", "undefined", "flat");
  for (int i = 0; i < 3; i++) fmt::print("  {:>9} {:>8}", "rms", "greatest");
  fmt::print("\n");
  for (const StreamComparisonRow& row : c.rows) {
    fmt::print("{:<12} {:>9} {:>5}", name_of(row.derivatives), row.undefined, row.flat);
    for (const ErrorMeasure& measure : {row.normal, row.mean, row.gauss})
      fmt::print("  {:>9} {:>8}", error_text(measure.rms), error_text(measure.greatest));
    fmt::print("\n");
  }
  fmt::print(
      "\nCurvatures: absolute errors; the surface has mean {}, Gauss {} (rms). undefined: hits without a normal; flat: "
      "hits with a\nnormal but without curvature.\n"
      "The mesh lies {} (rms), at most {} from the true surface, at {} random places (u, tau); asked for was {:.1e}.\n",
      error_text(c.mean_rms), error_text(c.gauss_rms), error_text(c.deviation.rms), error_text(c.deviation.greatest),
      c.places, c.tolerance);
}

void write_comparison(const StreamComparison& c, const std::filesystem::path& file) {
  constexpr std::string_view number_names[] = {
      "normal_rms",          "normal_max",           "mean_rms",      "mean_max",      "gauss_rms", "gauss_max",
      "integrated_mean_rms", "integrated_gauss_rms", "deviation_rms", "deviation_max", "tolerance"};
  constexpr std::string_view count_names[] = {"rays", "hits", "sampled", "places", "undefined", "flat"};
  std::vector<std::string_view> derivatives;
  std::vector<std::vector<float>> numbers(std::size(number_names));
  std::vector<std::vector<std::uint64_t>> counts(std::size(count_names));
  for (const StreamComparisonRow& row : c.rows) {
    derivatives.push_back(name_of(row.derivatives));
    const double of_row[] = {row.normal.rms,  row.normal.greatest,  row.mean.rms, row.mean.greatest,
                             row.gauss.rms,   row.gauss.greatest,   c.mean_rms,   c.gauss_rms,
                             c.deviation.rms, c.deviation.greatest, c.tolerance};
    for (std::size_t i = 0; i < numbers.size(); i++) numbers[i].push_back(float(of_row[i]));
    const std::size_t counted[] = {c.rays, c.hits, c.sampled, c.places, row.undefined, row.flat};
    for (std::size_t i = 0; i < counts.size(); i++) counts[i].push_back(counted[i]);
  }
  Table table;
  table.add("derivatives", derivatives);
  for (std::size_t i = 0; i < counts.size(); i++) table.add(count_names[i], counts[i]);
  for (std::size_t i = 0; i < numbers.size(); i++) table.add(number_names[i], numbers[i]);
  write_table(table, file);
}

void compare_stream_surface(const Surface& surface, const CompareCommand& command, const CommonOptions& common) {
  if (command.asks_for_samples) {
    throw Error(ErrorCode::usage,
                "--resolutions, --apron and --margin go with surfaces that are sampled, not with stream surfaces");
  }
  const Device device = open(command.device, common);
  StreamComparison comparison;
  {
    Progress progress("comparing", common.quiet);
    comparison = naming(command.surface, [&] {
      return compare_stream(device, surface,
                            {.rays = command.rays, .seed = command.seed, .progress = progress.callback()});
    });
  }
  if (!command.output.empty()) write_comparison(comparison, command.output);
  print_comparison(comparison);
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
  if (surface.kind() == "stream") return compare_stream_surface(surface, command, common);
  const Device device = open(command.device, common);

  Comparison comparison;
  {
    Progress progress("comparing", common.quiet);
    comparison = naming(command.surface, [&] {
      return compare(device, surface,
                     {.resolutions = *resolutions,
                      .rays = command.rays,
                      .seed = command.seed,
                      .apron = command.apron,
                      .margin = command.margin,
                      .progress = progress.callback()});
    });
  }
  if (!command.output.empty()) write_comparison(comparison, command.output);
  print_comparison(comparison);
  report(device, common, "rays", comparison.device_rays, comparison.device_seconds);
}

}  // namespace smurf
