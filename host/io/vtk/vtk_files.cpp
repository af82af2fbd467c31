#include "io/vtk/vtk_files.hpp"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSetAttributes.h>
#include <vtkGenericDataObjectReader.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkRectilinearGrid.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLRectilinearGridReader.h>
#include <vtkXMLStructuredGridReader.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>
#include <string>

#include "io/description.hpp"
#include "io/vtk/quiet_reading.hpp"
#include "numerics/input_file.hpp"
#include "numerics/text_file.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

[[noreturn]] void fail(const path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}

// ---- Files

// VTK takes memory for what a header asks for before it looks at the data. A node takes at least a bit; zlib packs 1032
// bytes into one at most.
void check_sizes(const path& file, std::string_view beginning, double bytes) {
  const auto numbers_after = [&](std::string_view key) {
    std::vector<double> numbers;
    const auto found = beginning.find(key);
    if (found == beginning.npos) return numbers;
    std::string_view rest = beginning.substr(found + key.size(), 200);
    while (numbers.size() < 6) {
      const auto first = rest.find_first_not_of(" \t\r\n\"='");
      if (first == rest.npos) break;
      const auto end = std::min(rest.find_first_of(" \t\r\n\"='", first), rest.size());
      double value = 0;
      if (parse_number(rest.substr(first, end - first), value) != NumberParse::ok) break;
      numbers.push_back(value);
      rest.remove_prefix(end);
    }
    return numbers;
  };
  double nodes = 0;
  if (const std::vector<double> n = numbers_after("DIMENSIONS"); n.size() >= 3) nodes = n[0] * n[1] * n[2];
  if (const std::vector<double> n = numbers_after("WholeExtent"); n.size() == 6)
    nodes = (n[1] - n[0] + 1) * (n[3] - n[2] + 1) * (n[5] - n[4] + 1);
  if (nodes > double(std::numeric_limits<std::int32_t>::max()))
    fail(file, fmt::format("{:.0f} nodes; at most 2^31-1 are possible", nodes));
  if (nodes / 8 / 1032 > bytes)
    fail(file, fmt::format("{:.0f} nodes cannot be in a file of {:.0f} bytes", nodes, bytes));
}

template <class Reader>
vtkSmartPointer<vtkDataObject> read_by(Reader* reader, const path& file) {
  reader->SetFileName(file.c_str());
  reader->Update();
  return reader->GetOutputDataObject(0);
}

vtkSmartPointer<vtkDataObject> read_legacy(const path& file) {
  const vtkNew<vtkGenericDataObjectReader> reader;
  reader->ReadAllScalarsOn();
  reader->ReadAllVectorsOn();
  reader->ReadAllNormalsOn();
  reader->ReadAllTensorsOn();
  reader->ReadAllColorScalarsOn();
  reader->ReadAllTCoordsOn();
  reader->ReadAllFieldsOn();
  return read_by(reader.GetPointer(), file);
}

vtkSmartPointer<vtkDataSet> read_data_set(const path& file) {
  {
    const InputFile input(file);  // says what is wrong with files that cannot be opened
    std::string beginning(std::min<std::size_t>(input.size(), 1 << 14), '\0');
    input.read_at(0, beginning.data(), beginning.size());
    check_sizes(file, beginning, double(input.size()));
  }
  const std::string ending = description::ending_of(file);
  vtkSmartPointer<vtkDataObject> object;
  std::string complaint;
  try {
    complaint = complaint_of([&] {
      if (ending == ".vti") object = read_by(vtkNew<vtkXMLImageDataReader>().GetPointer(), file);
      else if (ending == ".vtr") object = read_by(vtkNew<vtkXMLRectilinearGridReader>().GetPointer(), file);
      else if (ending == ".vts") object = read_by(vtkNew<vtkXMLStructuredGridReader>().GetPointer(), file);
      else object = read_legacy(file);
    });
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::memory, fmt::format("\"{}\": the memory for its data is not there", file.string()));
  } catch (const std::exception& error) {
    fail(file, fmt::format("VTK cannot read this file: {}", error.what()));
  }
  if (!complaint.empty()) fail(file, fmt::format("VTK cannot read this file: {}", complaint));
  if (object == nullptr) fail(file, "VTK finds nothing in this file");
  vtkDataSet* set = vtkDataSet::SafeDownCast(object);
  const bool of_a_grid = vtkImageData::SafeDownCast(object) != nullptr ||
                         vtkRectilinearGrid::SafeDownCast(object) != nullptr ||
                         vtkStructuredGrid::SafeDownCast(object) != nullptr;
  if (set == nullptr || !of_a_grid)
    fail(file, fmt::format("holds a {}; smurf reads structured points, rectilinear grids and structured grids",
                           object->GetClassName()));
  if (set->GetNumberOfPoints() == 0) fail(file, "the grid has no nodes, or the file ends before them");
  return set;
}

// ---- Grids

glm::ivec3 size_of(vtkDataSet* set) {
  int size[3] = {0, 0, 0};
  if (auto* image = vtkImageData::SafeDownCast(set)) image->GetDimensions(size);
  else if (auto* rectilinear = vtkRectilinearGrid::SafeDownCast(set)) rectilinear->GetDimensions(size);
  else if (auto* structured = vtkStructuredGrid::SafeDownCast(set)) structured->GetDimensions(size);
  return {size[0], size[1], size[2]};
}

std::size_t product(glm::ivec3 size) { return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z); }

GridPlacement placement_of(vtkImageData* image) {
  const double *origin = image->GetOrigin(), *spacing = image->GetSpacing();
  const int* extent = image->GetExtent();
  GridPlacement placement;
  placement.origin = {origin[0], origin[1], origin[2]};
  for (int axis = 0; axis < 3; axis++) {
    for (int row = 0; row < 3; row++)
      placement.axes[axis][row] = image->GetDirectionMatrix()->GetElement(row, axis) * spacing[axis];
    placement.origin += placement.axes[axis] * double(extent[2 * axis]);
  }
  return placement;
}

std::vector<double> coordinates(const path& file, vtkDataArray* array, int count) {
  if (array == nullptr || array->GetNumberOfTuples() != count)
    fail(file,
         fmt::format("{} coordinates along an axis with {} nodes", array ? array->GetNumberOfTuples() : 0, count));
  std::vector<double> values(static_cast<std::size_t>(count));
  for (int i = 0; i < count; i++) values[std::size_t(i)] = array->GetComponent(i, 0);
  return values;
}

Values<glm::dvec3> points_of(const path& file, vtkStructuredGrid* grid, std::size_t nodes) {
  vtkPoints* points = grid->GetPoints();
  const std::size_t there = points == nullptr ? 0 : std::size_t(points->GetNumberOfPoints());
  if (there != nodes) fail(file, fmt::format("{} points for {} nodes", there, nodes));
  Values<glm::dvec3> out(nodes);
  for (std::size_t i = 0; i < nodes; i++) points->GetPoint(vtkIdType(i), &out[i].x);
  return out;
}

// ---- Arrays

struct Array {
  vtkDataArray* data = nullptr;
  bool of_cells = false;
  std::string name() const { return data->GetName() != nullptr ? data->GetName() : ""; }
};

std::vector<Array> arrays_of(vtkDataSet* set) {
  std::vector<Array> found;
  for (const bool of_cells : {false, true}) {
    vtkDataSetAttributes* attributes = set->GetPointData();
    if (of_cells) attributes = set->GetCellData();
    for (int i = 0; i < attributes->GetNumberOfArrays(); i++) {
      const Array array{attributes->GetArray(i), of_cells};  // null for arrays of text
      if (array.data != nullptr && array.name() != vtkDataSetAttributes::GhostArrayName()) found.push_back(array);
    }
  }
  return found;
}

std::string listed(const std::vector<Array>& arrays) {
  if (arrays.empty()) return "it has no arrays";
  std::vector<std::string> texts;
  for (const Array& array : arrays)
    texts.push_back(fmt::format("\"{}\" ({} component{}{})", array.name(), array.data->GetNumberOfComponents(),
                                array.data->GetNumberOfComponents() == 1 ? "" : "s",
                                array.of_cells ? ", of cells" : ""));
  return fmt::format("its arrays: {}", fmt::join(texts, ", "));
}

Array chosen(const path& file, vtkDataSet* set, std::string_view name, int components) {
  const std::vector<Array> all = arrays_of(set);
  const std::string wanted = components == 1 ? "1 component" : fmt::format("{} components", components);
  if (!name.empty()) {
    const auto found = std::ranges::find_if(all, [&](const Array& array) { return array.name() == name; });
    if (found == all.end()) fail(file, fmt::format("there is no array \"{}\"; {}", name, listed(all)));
    const int there = found->data->GetNumberOfComponents();
    if (there != components)
      fail(file, fmt::format("array \"{}\" has {} component{}, but {} needed; {}", name, there, there == 1 ? "" : "s",
                             components == 1 ? "1 is" : fmt::format("{} are", components), listed(all)));
    return *found;
  }
  std::vector<Array> fitting;
  for (const Array& array : all) {
    if (array.data->GetNumberOfComponents() == components) fitting.push_back(array);
  }
  if (fitting.empty()) fail(file, fmt::format("there is no array of {}; {}", wanted, listed(all)));
  if (fitting.size() > 1)
    fail(file, fmt::format("there are {} arrays of {}, name one of them as \"array\"; {}", fitting.size(), wanted,
                           listed(all)));
  return fitting[0];
}

// The bits of the ghost array by node or cell; empty where there is none.
std::vector<std::uint8_t> hidden(vtkDataSetAttributes* attributes, int bit, std::size_t count) {
  std::vector<std::uint8_t> out;
  vtkDataArray* ghosts = attributes->GetArray(vtkDataSetAttributes::GhostArrayName());
  if (ghosts == nullptr || std::size_t(ghosts->GetNumberOfTuples()) != count) return out;
  out.resize(count);
  for (std::size_t i = 0; i < count; i++) out[i] = (int(ghosts->GetComponent(vtkIdType(i), 0)) & bit) != 0 ? 1 : 0;
  if (std::ranges::find(out, 1) == out.end()) out.clear();
  return out;
}

// Calls visit(cell) for the cells about each node, of which a flat grid has one layer.
template <class Visit>
void cells_about(glm::ivec3 size, glm::ivec3 node, Visit visit) {
  const glm::ivec3 cells = glm::max(size - 1, glm::ivec3(1));
  const glm::ivec3 low = glm::max(node - 1, glm::ivec3(0)), high = glm::min(node, cells - 1);
  for (int k = low.z; k <= high.z; k++)
    for (int j = low.y; j <= high.y; j++)
      for (int i = low.x; i <= high.x; i++)
        visit(std::size_t(i) + std::size_t(cells.x) * (std::size_t(j) + std::size_t(cells.y) * std::size_t(k)));
}

template <class Visit>
void each_node(glm::ivec3 size, Visit visit) {
  std::size_t index = 0;
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++) visit(index++, glm::ivec3(i, j, k));
}

// An array with what it means at nodes.
struct NodeValues {
  Array array;
  glm::ivec3 size{0};
  std::vector<std::uint8_t> hidden_nodes, hidden_cells;

  // Values of cells: the mean of those about the node that are not hidden.
  template <class Store>
  void each(Store store) const {
    const int components = array.data->GetNumberOfComponents();
    if (!array.of_cells) {
      for (std::size_t i = 0; i < product(size); i++)
        for (int c = 0; c < components; c++) store(i, c, array.data->GetComponent(vtkIdType(i), c));
      return;
    }
    each_node(size, [&](std::size_t index, glm::ivec3 node) {
      double sum[3] = {0, 0, 0}, count = 0;
      cells_about(size, node, [&](std::size_t cell) {
        if (!hidden_cells.empty() && hidden_cells[cell] != 0) return;
        for (int c = 0; c < components; c++) sum[c] += array.data->GetComponent(vtkIdType(cell), c);
        count++;
      });
      for (int c = 0; c < components; c++) store(index, c, sum[c] / count);  // NaN where all cells are hidden
    });
  }

  std::vector<std::uint8_t> blanked() const {
    std::vector<std::uint8_t> out = hidden_nodes;
    if (hidden_cells.empty()) return out;
    out.resize(product(size), 0);
    each_node(size, [&](std::size_t index, glm::ivec3 node) {
      cells_about(size, node, [&](std::size_t cell) { out[index] |= hidden_cells[cell]; });
    });
    return out;
  }

  std::vector<Fact> notes() const {
    std::vector<Fact> facts{{"array", fmt::format("\"{}\"{}", array.name(),
                                                  array.of_cells ? ", given for cells; nodes have the mean of the "
                                                                   "cells about them"
                                                                 : "")}};
    if (!hidden_nodes.empty())
      facts.push_back({"hidden nodes", fmt::format("{}", std::ranges::count(hidden_nodes, 1))});
    if (!hidden_cells.empty())
      facts.push_back({"hidden cells", fmt::format("{}; their corners are blanked, and with them the cells beside",
                                                   std::ranges::count(hidden_cells, 1))});
    return facts;
  }
};

NodeValues values_of(const path& file, vtkDataSet* set, std::string_view name, int components) {
  NodeValues values;
  values.array = chosen(file, set, name, components);
  values.size = size_of(set);
  const std::size_t nodes = product(values.size), cells = product(glm::max(values.size - 1, glm::ivec3(1)));
  const std::size_t wanted = values.array.of_cells ? cells : nodes;
  const auto there = std::size_t(values.array.data->GetNumberOfTuples());
  if (there != wanted)
    fail(file, fmt::format("array \"{}\" has {} values for {} {}", values.array.name(), there, wanted,
                           values.array.of_cells ? "cells" : "nodes"));
  values.hidden_nodes = hidden(set->GetPointData(), vtkDataSetAttributes::HIDDENPOINT, nodes);
  values.hidden_cells = hidden(set->GetCellData(), vtkDataSetAttributes::HIDDENCELL, cells);
  return values;
}

// ---- Volumes

template <class T>
constexpr SampleType integer_type() {
  if constexpr (sizeof(T) == 8) return std::is_signed_v<T> ? SampleType::int64 : SampleType::uint64;
  else if constexpr (sizeof(T) == 4) return std::is_signed_v<T> ? SampleType::int32 : SampleType::uint32;
  else if constexpr (sizeof(T) == 2) return std::is_signed_v<T> ? SampleType::int16 : SampleType::uint16;
  else return std::is_signed_v<T> ? SampleType::int8 : SampleType::uint8;
}

std::optional<SampleType> sample_type(int vtk_type) {
  switch (vtk_type) {
    case VTK_FLOAT:
      return SampleType::float32;
    case VTK_DOUBLE:
      return SampleType::float64;
    case VTK_CHAR:
      return integer_type<char>();
    case VTK_SIGNED_CHAR:
      return SampleType::int8;
    case VTK_UNSIGNED_CHAR:
      return SampleType::uint8;
    case VTK_SHORT:
      return SampleType::int16;
    case VTK_UNSIGNED_SHORT:
      return SampleType::uint16;
    case VTK_INT:
      return integer_type<int>();
    case VTK_UNSIGNED_INT:
      return integer_type<unsigned>();
    case VTK_LONG:
      return integer_type<long>();
    case VTK_UNSIGNED_LONG:
      return integer_type<unsigned long>();
    case VTK_LONG_LONG:
      return integer_type<long long>();
    case VTK_UNSIGNED_LONG_LONG:
      return integer_type<unsigned long long>();
    case VTK_ID_TYPE:
      return integer_type<vtkIdType>();
    default:
      return std::nullopt;
  }
}

}  // namespace

bool built_with_vtk() { return true; }

VtkVectors read_vtk_vectors(const path& file, std::string_view array) {
  const vtkSmartPointer<vtkDataSet> set = read_data_set(file);
  const NodeValues values = values_of(file, set, array, 3);
  VtkVectors out;
  out.size = values.size;
  if (auto* image = vtkImageData::SafeDownCast(set)) {
    out.placement = placement_of(image);
  } else if (auto* rectilinear = vtkRectilinearGrid::SafeDownCast(set)) {
    out.grid = VtkGrid::rectilinear;
    out.axes = {coordinates(file, rectilinear->GetXCoordinates(), out.size.x),
                coordinates(file, rectilinear->GetYCoordinates(), out.size.y),
                coordinates(file, rectilinear->GetZCoordinates(), out.size.z)};
  } else {
    out.grid = VtkGrid::structured;
    out.points = points_of(file, vtkStructuredGrid::SafeDownCast(set), product(out.size));
  }
  out.vectors.resize(product(out.size));
  values.each([&](std::size_t node, int component, double value) { out.vectors[node][component] = float(value); });
  out.blanked = values.blanked();
  out.notes = values.notes();
  return out;
}

Volume read_vtk_volume(const path& file, std::string_view array) {
  const vtkSmartPointer<vtkDataSet> set = read_data_set(file);
  auto* image = vtkImageData::SafeDownCast(set);
  if (image == nullptr)
    fail(file, fmt::format("holds a {}; volumes are regular grids (structured points, .vti)", set->GetClassName()));
  const NodeValues values = values_of(file, set, array, 1);
  const std::vector<std::uint8_t> blanked = values.blanked();
  const std::optional<SampleType> type = sample_type(values.array.data->GetDataType());
  const GridPlacement placement = placement_of(image);
  try {
    if (type && !values.array.of_cells && blanked.empty()) {
      const vtkSmartPointer<vtkDataArray> kept(values.array.data);
      return {std::shared_ptr<const void>(kept->GetVoidPointer(0), [kept](const void*) {}), *type, values.size,
              placement};
    }
    const auto samples = std::make_shared<Values<float>>(product(values.size));
    values.each([&](std::size_t node, int, double value) { (*samples)[node] = float(value); });
    for (std::size_t i = 0; i < blanked.size(); i++) {
      if (blanked[i] != 0) (*samples)[i] = std::numeric_limits<float>::quiet_NaN();
    }
    return {std::shared_ptr<const void>(samples, samples->data()), SampleType::float32, values.size, placement};
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("\"{}\": {}", file.string(), error.what()));
  }
}

bool vtk_has_vectors(const path& file) {
  const vtkSmartPointer<vtkDataSet> set = read_data_set(file);
  return std::ranges::any_of(arrays_of(set),
                             [](const Array& array) { return array.data->GetNumberOfComponents() == 3; });
}

}  // namespace smurf
