#include "surfaces/record_answers.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>

#include "device/program.hpp"
#include "smurf/error.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {
namespace {

const char* answers_file() {
  const char* file = std::getenv("SMURF_ANSWERS");
  return file && *file ? file : nullptr;
}

// Columns one after the other, as bytes.
class Bytes {
 public:
  template <class T>
  void add(std::span<const T> values) {
    bytes_.append(fmt::format("{}:", values.size()));
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  std::string hash() const { return content_key(bytes_, ""); }

 private:
  std::string bytes_;
};

std::string hash_of(const RayBatch& rays, const CastOptions& options) {
  Bytes bytes;
  for (int c = 0; c < RayBatch::component_count; c++) bytes.add(rays.component(RayBatch::Component(c)));
  const std::uint64_t numbers[] = {rays.image_width, options.tile};
  bytes.add(std::span<const std::uint64_t>(numbers));
  return bytes.hash();
}

std::string_view word_of(Hits hits) {
  constexpr std::string_view words[] = {"first", "all", "any", "number of"};
  return words[std::size_t(hits)];
}

std::string hash_of(const PointSet& points) {
  Bytes bytes;
  bytes.add(points.locations);
  bytes.add(points.coordinates);
  bytes.add(points.directions);
  return bytes.hash();
}

std::string hash_of(const HitList& hits) {
  Bytes bytes;
  bytes.add(hits.offsets());
  bytes.add(hits.ray_status());
  if (!hits.counts().empty()) {
    bytes.add(hits.counts());
    bytes.add(hits.flagged());
  }
#define HIT_COLUMN(name, type, names, place) bytes.add(hits.name());
#include "smurf/hit_columns.def"
  return bytes.hash();
}

std::string hash_of(const PointProperties& p, std::uint32_t wanted) {
  Bytes bytes;
  const auto add = [&](Property property, const auto& column) {
    if (contains(wanted, property)) bytes.add(std::span(column.data(), column.size()));
  };
  add(Property::value, p.value);
  add(Property::normal, p.normal);
  add(Property::gauss, p.gauss);
  add(Property::mean, p.mean);
  add(Property::principal, p.k1);
  add(Property::principal, p.k2);
  add(Property::directions, p.d1);
  add(Property::directions, p.d2);
  add(Property::normal_curvature, p.normal_curvature);
  add(Property::parameters, p.coordinates);
  bytes.add(std::span(p.status.data(), p.status.size()));
  return bytes.hash();
}

// Other processes may write to the same file: a line goes there whole.
void write_line(const std::string& line) {
  const char* name = answers_file();
  const int file = ::open(name, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const bool written = file >= 0 && ::write(file, line.data(), line.size()) == ssize_t(line.size());
  if (file >= 0) ::close(file);
  if (!written) throw Error(ErrorCode::io, fmt::format("SMURF_ANSWERS: cannot write \"{}\"", name));
}

std::string name_of_device(const Device& device) {
  if (device.is_reference()) return "reference";
  const DeviceInfo& info = device.info();
  return fmt::format("{} ({}, {} lanes)", info.executor, info.name, info.lanes);
}

class RecordedQueries final : public SurfaceQueries {
 public:
  RecordedQueries(std::unique_ptr<SurfaceQueries> interrogation, std::string who)
      : queries_(std::move(interrogation)), who_(std::move(who)) {}

  void cast(const RayBatch& rays, const CastOptions& options, HitList& hits) override {
    queries_->cast(rays, options, hits);
    write_line(fmt::format("{}: {} hits of {} rays {} = {} hits {}\n", who_, word_of(options.hits), rays.size(),
                           hash_of(rays, options), hits.size(), hash_of(hits)));
    if (options.properties != 0) {
      const PointSet points{hits.locations(), hits.coordinates(), {}};
      record(points, options.properties, hits.properties(options.properties));
    }
  }

  void measure(const PointSet& points, std::uint32_t wanted, const ProbeOptions& options,
               PointProperties& out) override {
    queries_->measure(points, wanted, options, out);
    record(points, wanted, out);
  }

  void walk(const WalkStart& start, const WalkOptions& options, const WalkSink& sink) override {
    queries_->walk(start, options, [&](const WalkedPoints& walked) {
      Bytes bytes;
      bytes.add(walked.locations);
      bytes.add(walked.status);
      write_line(fmt::format("{}: step {} of a walk from points {} on, {} = {}\n", who_, walked.step, walked.first,
                             hash_of(start.points), bytes.hash()));
      sink(walked);
    });
  }

  void update(const std::shared_ptr<const SurfaceDefinition>& model) override { queries_->update(model); }
  std::size_t device_bytes() const override { return queries_->device_bytes(); }

 private:
  void record(const PointSet& points, std::uint32_t wanted, const PointProperties& answer) const {
    write_line(fmt::format("{}: properties {:#x} of {} points {} = {}\n", who_, wanted, points.locations.size(),
                           hash_of(points), hash_of(answer, wanted)));
  }

  std::unique_ptr<SurfaceQueries> queries_;
  std::string who_;
};

}  // namespace

std::shared_ptr<SurfaceQueries> recorded(std::unique_ptr<SurfaceQueries> interrogation, const std::string& kind,
                                         const Device& device) {
  if (!answers_file()) return interrogation;
  return std::make_shared<RecordedQueries>(std::move(interrogation),
                                           fmt::format("{} on {}", kind, name_of_device(device)));
}

void record_properties(const std::string& kind, const Device& device, const PointSet& points, std::uint32_t wanted,
                       const PointProperties& answer) {
  if (!answers_file()) return;
  write_line(fmt::format("{} on {}: properties {:#x} of {} points {} = {}\n", kind, name_of_device(device), wanted,
                         points.locations.size(), hash_of(points), hash_of(answer, wanted)));
}

}  // namespace smurf
