// Device memory: 88 bytes a piece of the seed curve, a few for a polyline or a spline of few points, and the field's.
#include "surfaces/stream/flow_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "flows/kinds.hpp"
#include "kernels/stream/layout.inc"

namespace smurf {
namespace {

constexpr double greatest_error = 1e-9;        // of c, of the extent
constexpr double greatest_slope_error = 1e-8;  // of c', of the greatest |c'|
constexpr double greatest_bend_error = 1e-5;   // of c'', of the greatest |c''|
constexpr int deepest = 20;                    // halvings
constexpr std::size_t most_pieces = 1 << 16;
constexpr int checks = 9;             // places in a piece
constexpr double closed_part = 1e-6;  // of the extent, within which the ends of a curve are one point
// Of a step: the tolerance is a tenth of the surface's, and no less than what floats tell.
constexpr double tolerance_part = 0.1, least_tolerance = 0x1p-22;
constexpr double longest_step = 1.0 / 16;  // of the extent: a step must not pass over what is small
constexpr int most_steps = 10000;

bool finite(const glm::dvec3& v) { return std::isfinite(v.x + v.y + v.z); }

using Coefficients = std::array<glm::dvec3, 6>;

Coefficients hermite(const SeedPoint& a, const SeedPoint& b, double width) {
  const glm::dvec3 d0 = a.first * width, d1 = b.first * width;
  const glm::dvec3 e0 = a.second * (width * width), e1 = b.second * (width * width);
  const glm::dvec3 rise = b.position - a.position - d0 - 0.5 * e0;
  const glm::dvec3 slope = d1 - d0 - e0, bend = e1 - e0;
  return {a.position,
          d0,
          0.5 * e0,
          10.0 * rise - 4.0 * slope + 0.5 * bend,
          -15.0 * rise + 7.0 * slope - bend,
          6.0 * rise - 3.0 * slope + 0.5 * bend};
}

SeedPoint evaluate(const Coefficients& k, double s, double width) {
  SeedPoint p;
  for (std::size_t i = 6; i-- > 0;) {
    p.second = p.second * s + 2.0 * p.first;
    p.first = p.first * s + p.position;
    p.position = p.position * s + k[i];
  }
  return {p.position, p.first / width, p.second / (width * width)};
}

class SeedTableMaker {
 public:
  SeedTableMaker(const SeedCurve& seed, double extent) : seed_(seed), extent_(extent) {}

  SeedTable make() {
    const glm::dvec2 range = seed_.range();
    std::vector<double> borders{range.x};
    for (const double corner : seed_.corners()) {
      if (corner > borders.back() && corner < range.y) borders.push_back(corner);
    }
    borders.push_back(range.y);
    constexpr int places = 256;
    for (int i = 0; i <= places; i++) {
      const SeedPoint p = seed_.at(std::lerp(range.x, range.y, (i + 0.37) / (places + 1)));
      if (finite(p.first)) speed_ = std::max(speed_, glm::length(p.first));
      if (finite(p.second)) bend_ = std::max(bend_, glm::length(p.second));
    }
    bend_ = std::max(bend_, speed_ / (range.y - range.x));
    for (std::size_t i = 0; i + 1 < borders.size(); i++) {
      low_ = borders[i];
      high_ = borders[i + 1];
      add(borders[i], borders[i + 1], 0);
    }
    table_.begin.push_back(range.y);
    table_.closed = glm::length(seed_.at(range.x).position - seed_.at(range.y).position) <= closed_part * extent_;
    return std::move(table_);
  }

 private:
  // The derivatives at the ends of a smooth stretch are those of its own side.
  SeedPoint inside(double u) const {
    SeedPoint p = seed_.at(u);
    const double nudge = 1e-7 * (high_ - low_);
    const bool at_end = u == low_ || u == high_;
    if (!at_end && finite(p.first) && finite(p.second)) return p;
    const double beside = u == low_ ? u + nudge : u - nudge;
    const SeedPoint near = seed_.at(beside);
    p.first = near.first + near.second * (u - beside);
    p.second = near.second;
    return p;
  }

  void add(double from, double to, int depth) {
    const double width = to - from;
    const SeedPoint a = inside(from), b = inside(to);
    Coefficients k = hermite(a, b, width);
    bool known = finite(a.first) && finite(b.first) && finite(a.second) && finite(b.second);
    if (!known) k = {a.position, b.position - a.position};
    double error = 0, slope = 0, bend = 0;
    for (int i = 0; i < checks; i++) {
      const double s = (i + 0.5) / checks;
      const SeedPoint truth = seed_.at(from + s * width);
      const SeedPoint made = evaluate(k, s, width);
      error = std::max(error, glm::length(made.position - truth.position) / extent_);
      if (finite(truth.first)) slope = std::max(slope, glm::length(made.first - truth.first) / speed_);
      if (finite(truth.second)) bend = std::max(bend, glm::length(made.second - truth.second) / bend_);
    }
    const bool good = error <= greatest_error && slope <= greatest_slope_error && bend <= greatest_bend_error;
    const double middle = double(float(0.5 * (from + to)));
    if (!good && depth < deepest && table_.size() < most_pieces && middle > from && middle < to) {
      add(from, middle, depth + 1);
      add(middle, to, depth + 1);
      return;
    }
    table_.begin.push_back(from);
    table_.coefficients.push_back(k);
    table_.error = std::max(table_.error, error);
    table_.slope_error = std::max(table_.slope_error, slope);
  }

  const SeedCurve& seed_;
  const double extent_;
  double speed_ = 0, bend_ = 0;
  double low_ = 0, high_ = 0;  // the stretch between corners
  SeedTable table_;
};

std::vector<std::uint32_t> words_of(const SeedTable& table) {
  std::vector<std::uint32_t> words;
  const auto put = [&](double value) { words.push_back(std::bit_cast<std::uint32_t>(float(value))); };
  for (const double u : table.begin) put(u);
  for (std::size_t i = 0; i < table.size(); i++) {
    const Coefficients& k = table.coefficients[i];
    put(1 / (table.begin[i + 1] - table.begin[i]));
    for (int axis = 0; axis < 3; axis++) put(k[0][axis]);
    for (int axis = 0; axis < 3; axis++) put(k[0][axis] - double(float(k[0][axis])));
    for (std::size_t power = 1; power < 6; power++) {
      for (int axis = 0; axis < 3; axis++) put(k[power][axis]);
    }
  }
  return words;
}

}  // namespace

SeedPoint SeedTable::at(double u) const {
  const auto after = std::upper_bound(begin.begin(), begin.end() - 1, u);
  const auto i = std::size_t(std::max<std::ptrdiff_t>(after - begin.begin() - 1, 0));
  const double width = begin[i + 1] - begin[i];
  return evaluate(coefficients[i], std::clamp((u - begin[i]) / width, 0.0, 1.0), width);
}

SeedTable make_seed_table(const SeedCurve& seed, double extent) { return SeedTableMaker(seed, extent).make(); }

StreamMap::StreamMap(const StreamSurface& surface, Executor& executor, const PrepareOptions& options)
    : flow_(reside(surface.field(), executor, options)),
      table_(make_seed_table(surface.seed(), surface.field_extent())),
      smooth_(surface.is_smooth()),
      neighbours_(surface.options().derivatives == StreamDerivatives::neighbours) {
  for (const NamedBuffer& buffer : flow_->buffers()) flow_names_.push_back(fmt::format("flow_{}", buffer.name));
  const double extent = surface.field_extent();
  const Bounds bounds = surface.field().bounds();
  double farthest = extent;
  for (int axis = 0; axis < 3; axis++)
    farthest = std::max({farthest, std::abs(bounds.lower[axis]), std::abs(bounds.upper[axis])});
  tolerance_ = std::max({tolerance_part * surface.options().tolerance, least_tolerance * extent, 0x1p-24 * farthest});
  const glm::dvec2 range = surface.seed().range(), time = surface.options().time;
  std::array<std::uint32_t, STREAM_UNIFORM_WORDS> words{};
  const auto put = [&](int at, double value) { words[std::size_t(at)] = std::bit_cast<std::uint32_t>(float(value)); };
  put(STREAM_LOWER_U, range.x);
  put(STREAM_UPPER_U, range.y);
  put(STREAM_LOWER_T, time.x);
  put(STREAM_UPPER_T, time.y);
  put(STREAM_TOLERANCE, tolerance_);
  put(STREAM_RELATIVE, tolerance_ / extent);
  put(STREAM_LONGEST, longest_step * extent);
  put(STREAM_EXTENT, extent);
  words[STREAM_SEGMENTS] = std::uint32_t(table_.size());
  words[STREAM_CLOSED] = table_.closed ? 1 : 0;
  words[STREAM_MOST_STEPS] = most_steps;
  uniforms_ = TypedBuffer<std::uint32_t>(executor, words.size(), "surface uniforms");
  uniforms_.write(words);
  const std::vector<std::uint32_t> pieces = words_of(table_);
  seed_ = TypedBuffer<std::uint32_t>(executor, pieces.size(), "seed curve");
  seed_.write(pieces);
}

void StreamMap::add_to(std::map<std::string, std::string>& modules, std::map<std::string, std::string>& defines) const {
  modules.insert(flow_->modules().begin(), flow_->modules().end());
  defines.insert(flow_->defines().begin(), flow_->defines().end());
  modules["integrator"] = kernel_source("flow/dormand_prince.inc");
  defines["STREAM_SMOOTH"] = smooth_ ? "1" : "0";
  defines["STREAM_NEIGHBOURS"] = neighbours_ ? "1" : "0";
  // The field's own buffers, as it knows them.
  std::string text = "STRUCT(FlowBuffers) {";
  for (const NamedBuffer& buffer : flow_->buffers()) text += fmt::format(" Buffer {};", buffer.name);
  text += " };\nFN FlowBuffers stream_flow_buffers(SurfaceBuffers buffers) {\n  FlowBuffers flow;\n";
  for (const NamedBuffer& buffer : flow_->buffers())
    text += fmt::format("  flow.{0} = buffers.flow_{0};\n", buffer.name);
  text += "  return flow;\n}\n#include \"flow\"\n";
  modules["stream_flow"] = text;
}

void StreamMap::add_to(BufferGroup& buffers) const {
  buffers.push_back({"stream", uniforms_.get()});
  buffers.push_back({"seed", seed_.get()});
  const BufferGroup flow = flow_->buffers();
  for (std::size_t i = 0; i < flow.size(); i++) buffers.push_back({flow_names_[i], flow[i].buffer});
}

}  // namespace smurf
