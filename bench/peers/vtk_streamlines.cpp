#include "peers/vtk_streamlines.hpp"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStreamSurface.h>
#include <vtkStreamTracer.h>
#include <vtkStructuredGrid.h>

namespace smurf::bench {
namespace {

void add_vectors(vtkDataSet& data, std::span<const glm::vec3> vectors) {
  vtkNew<vtkFloatArray> array;
  array->SetName("vectors");
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(vtkIdType(vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); i++) array->SetTypedTuple(vtkIdType(i), &vectors[i].x);
  data.GetPointData()->SetVectors(array);
}

}  // namespace

struct VtkStreamTracer::State {
  vtkSmartPointer<vtkDataSet> data;
};

VtkStreamTracer::VtkStreamTracer(const VectorGrid& grid) : state_(std::make_unique<State>()) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(grid.size.x, grid.size.y, grid.size.z);
  const glm::dmat3& axes = grid.placement.axes;
  const glm::dvec3& origin = grid.placement.origin;
  image->SetOrigin(origin.x, origin.y, origin.z);
  image->SetSpacing(axes[0][0], axes[1][1], axes[2][2]);
  add_vectors(*image, grid.vectors);
  state_->data = image;
}

VtkStreamTracer::VtkStreamTracer(const CurvilinearBlock& block) : state_(std::make_unique<State>()) {
  vtkNew<vtkStructuredGrid> grid;
  grid->SetDimensions(block.size.x, block.size.y, block.size.z);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const glm::dvec3& p : block.points) points->InsertNextPoint(p.x, p.y, p.z);
  grid->SetPoints(points);
  add_vectors(*grid, block.vectors);
  state_->data = grid;
}

VtkStreamTracer::~VtkStreamTracer() = default;

VtkLines VtkStreamTracer::trace(std::span<const glm::dvec3> seeds, double step, double length, double error) const {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const glm::dvec3& p : seeds) points->InsertNextPoint(p.x, p.y, p.z);
  vtkNew<vtkPolyData> source;
  source->SetPoints(points);
  vtkNew<vtkStreamTracer> tracer;
  tracer->SetInputData(state_->data);
  tracer->SetSourceData(source);
  tracer->SetIntegrationDirectionToForward();
  tracer->SetIntegrationStepUnit(vtkStreamTracer::LENGTH_UNIT);
  tracer->SetInitialIntegrationStep(step);
  tracer->SetMaximumPropagation(length);
  tracer->SetMaximumNumberOfSteps(10'000'000);
  tracer->SetTerminalSpeed(1e-12);
  tracer->SetComputeVorticity(false);
  if (error > 0) {
    tracer->SetIntegratorTypeToRungeKutta45();
    tracer->SetMaximumError(error);
    tracer->SetMinimumIntegrationStep(1e-3 * step);
    tracer->SetMaximumIntegrationStep(step);
  } else {
    tracer->SetIntegratorTypeToRungeKutta4();
  }
  tracer->Update();
  vtkPolyData* output = tracer->GetOutput();
  VtkLines lines;
  lines.offsets.push_back(0);
  vtkDataArray* times = output->GetPointData()->GetArray("IntegrationTime");
  auto* ids = vtkIntArray::SafeDownCast(output->GetCellData()->GetArray("SeedIds"));
  vtkNew<vtkIdList> cell;
  for (vtkIdType i = 0; i < output->GetNumberOfLines(); i++) {
    output->GetLines()->GetCellAtId(i, cell);
    for (vtkIdType k = 0; k < cell->GetNumberOfIds(); k++) {
      double p[3];
      output->GetPoint(cell->GetId(k), p);
      lines.positions.emplace_back(p[0], p[1], p[2]);
      lines.times.push_back(times->GetTuple1(cell->GetId(k)));
    }
    lines.offsets.push_back(lines.positions.size());
    lines.seeds.push_back(ids != nullptr ? std::size_t(ids->GetValue(i)) : std::size_t(i));
  }
  return lines;
}

VtkLines VtkStreamTracer::rk4(std::span<const glm::dvec3> seeds, double step, double length) const {
  return trace(seeds, step, length, 0);
}

VtkLines VtkStreamTracer::adaptive(std::span<const glm::dvec3> seeds, double step, double length, double error) const {
  return trace(seeds, step, length, error);
}

VtkTriangles VtkStreamTracer::surface(std::span<const glm::dvec3> seeds, double step, double length,
                                      bool adaptive) const {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> line;
  line->InsertNextCell(int(seeds.size()));
  for (const glm::dvec3& p : seeds) line->InsertCellPoint(points->InsertNextPoint(p.x, p.y, p.z));
  vtkNew<vtkPolyData> source;
  source->SetPoints(points);
  source->SetLines(line);
  vtkNew<vtkStreamSurface> tracer;
  tracer->SetInputData(state_->data);
  tracer->SetSourceData(source);
  tracer->SetUseIterativeSeeding(adaptive);
  tracer->SetIntegrationDirectionToForward();
  tracer->SetIntegratorTypeToRungeKutta4();
  tracer->SetIntegrationStepUnit(vtkStreamTracer::LENGTH_UNIT);
  tracer->SetInitialIntegrationStep(step);
  tracer->SetMaximumPropagation(length);
  tracer->SetMaximumNumberOfSteps(vtkIdType(length / step + 0.5));
  tracer->SetTerminalSpeed(1e-12);
  tracer->SetComputeVorticity(false);
  tracer->Update();
  vtkPolyData* output = tracer->GetOutput();
  VtkTriangles surface;
  for (vtkIdType i = 0; i < output->GetNumberOfPoints(); i++) {
    double p[3];
    output->GetPoint(i, p);
    surface.points.emplace_back(p[0], p[1], p[2]);
  }
  vtkNew<vtkIdList> cell;
  const auto corner = [&](vtkIdType k) { return std::uint32_t(cell->GetId(k)); };
  for (vtkIdType i = 0; i < output->GetNumberOfPolys(); i++) {
    output->GetPolys()->GetCellAtId(i, cell);
    for (vtkIdType k = 2; k < cell->GetNumberOfIds(); k++)
      surface.triangles.emplace_back(corner(0), corner(k - 1), corner(k));
  }
  for (vtkIdType i = 0; i < output->GetNumberOfStrips(); i++) {
    output->GetStrips()->GetCellAtId(i, cell);
    for (vtkIdType k = 2; k < cell->GetNumberOfIds(); k++)
      surface.triangles.emplace_back(corner(k - 2), corner(k - 1), corner(k));
  }
  return surface;
}

}  // namespace smurf::bench
