#include "io/volumes/nrrd_vectors.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "io/volumes/nrrd_file.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

[[noreturn]] void fail(const path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}

NrrdFile vector_header(const path& file) {
  NrrdFile nrrd = read_nrrd(file);
  if (nrrd.components != 3)
    fail(file, fmt::format("{} a node; vectors need dimension 4 with 3 components along the first axis",
                           nrrd.components == 1 ? "1 component" : fmt::format("{} components", nrrd.components)));
  if (nrrd.components_have_direction)
    fail(file, "the first axis has a space direction; that of the components of vectors is \"none\"");
  return nrrd;
}

template <class Real, class Sample>
Values<glm::vec<3, Real>> converted(const void* samples, std::size_t nodes, const std::optional<glm::dmat3>& frame) {
  const auto* from = static_cast<const Sample*>(samples);
  Values<glm::vec<3, Real>> out(nodes);
  for (std::size_t i = 0; i < nodes; i++) {
    const glm::dvec3 v{double(from[3 * i]), double(from[3 * i + 1]), double(from[3 * i + 2])};
    out[i] = glm::vec<3, Real>(frame ? *frame * v : v);
  }
  return out;
}

template <class Real>
Values<glm::vec<3, Real>> read(const NrrdFile& nrrd) {
  const std::shared_ptr<const void> samples = nrrd.read();
  const std::size_t nodes = std::size_t(nrrd.size.x) * std::size_t(nrrd.size.y) * std::size_t(nrrd.size.z);
  const void* from = samples.get();
  const std::optional<glm::dmat3>& frame = nrrd.measurement_frame;
  switch (nrrd.type) {
    case SampleType::uint8:
      return converted<Real, std::uint8_t>(from, nodes, frame);
    case SampleType::int8:
      return converted<Real, std::int8_t>(from, nodes, frame);
    case SampleType::uint16:
      return converted<Real, std::uint16_t>(from, nodes, frame);
    case SampleType::int16:
      return converted<Real, std::int16_t>(from, nodes, frame);
    case SampleType::uint32:
      return converted<Real, std::uint32_t>(from, nodes, frame);
    case SampleType::int32:
      return converted<Real, std::int32_t>(from, nodes, frame);
    case SampleType::uint64:
      return converted<Real, std::uint64_t>(from, nodes, frame);
    case SampleType::int64:
      return converted<Real, std::int64_t>(from, nodes, frame);
    case SampleType::float32:
      return converted<Real, float>(from, nodes, frame);
    case SampleType::float64:
      return converted<Real, double>(from, nodes, frame);
  }
  throw std::logic_error("not a sample type");
}

}  // namespace

bool nrrd_has_vectors(const path& file) {
  const NrrdFile nrrd = read_nrrd(file);
  return nrrd.components == 3 && !nrrd.components_have_direction;
}

VectorGrid read_nrrd_vectors(const path& file) {
  const NrrdFile nrrd = vector_header(file);
  return {nrrd.size, nrrd.placement, read<float>(nrrd)};
}

CurvilinearBlock read_nrrd_block(const path& points, const path& vectors) {
  const NrrdFile nodes = vector_header(points), values = vector_header(vectors);
  if (nodes.size != values.size)
    fail(vectors, fmt::format("{}x{}x{} vectors, but \"{}\" has {}x{}x{} points; they must agree", values.size.x,
                              values.size.y, values.size.z, points.string(), nodes.size.x, nodes.size.y, nodes.size.z));
  return {nodes.size, read<double>(nodes), read<float>(values), {}};
}

}  // namespace smurf
