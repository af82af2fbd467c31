#include "peers/gage.hpp"

#include <teem/gage.h>

#include <cmath>
#include <string>

#include "parallel.hpp"
#include "smurf/error.hpp"

namespace smurf::bench {
namespace {

// In place along one line: samples -> interpolating cubic B-spline coefficients, mirrored about the end nodes (Unser
// 1999).
void prefilter_line(double* line, int count) {
  if (count < 2) return;
  const double pole = std::sqrt(3.0) - 2.0;
  const int period = 2 * count - 2;
  double first = 0, power = 1;
  for (int i = 0; i < period; i++, power *= pole) first += power * line[i < count ? i : period - i];
  line[0] = first / (1 - power);
  for (int i = 1; i < count; i++) line[i] += pole * line[i - 1];
  line[count - 1] = pole / (pole * pole - 1) * (line[count - 1] + pole * line[count - 2]);
  for (int i = count - 2; i >= 0; i--) line[i] = pole * (line[i + 1] - line[i]);
  for (int i = 0; i < count; i++) line[i] *= 6;
}

std::vector<float> spline_coefficients(std::span<const float> samples, glm::ivec3 size) {
  std::vector<double> values(samples.begin(), samples.end());
  const std::size_t strides[3] = {1, std::size_t(size.x), std::size_t(size.x) * std::size_t(size.y)};
  std::vector<double> line;
  for (int axis = 0; axis < 3; axis++) {
    const std::size_t length = std::size_t(size[axis]), stride = strides[axis];
    line.resize(length);
    for (std::size_t start = 0; start < values.size(); start++) {
      if (start / stride % length != 0) continue;
      for (std::size_t i = 0; i < length; i++) line[i] = values[start + i * stride];
      prefilter_line(line.data(), int(length));
      for (std::size_t i = 0; i < length; i++) values[start + i * stride] = line[i];
    }
  }
  return {values.begin(), values.end()};
}

[[noreturn]] void fail(const char* key) {
  char* text = biffGetDone(key);
  const std::string message = text ? text : "unknown";
  std::free(text);
  throw Error(ErrorCode::device, "gage: " + message);
}

}  // namespace

struct GageProbe::State {
  ~State() {
    for (gageContext* context : contexts) gageContextNix(context);
    nrrdNix(volume);
  }
  std::vector<float> coefficients;
  Nrrd* volume = nrrdNew();
  std::vector<gageContext*> contexts;
};

GageProbe::GageProbe(std::span<const float> samples, glm::ivec3 size) : state_(std::make_unique<State>()) {
  state_->coefficients = spline_coefficients(samples, size);
  // nrrdNix leaves the samples alone: they are the vector's.
  if (nrrdWrap_va(state_->volume, state_->coefficients.data(), nrrdTypeFloat, 3, std::size_t(size.x),
                  std::size_t(size.y), std::size_t(size.z)))
    fail(NRRD);
  nrrdAxisInfoSet_va(state_->volume, nrrdAxisInfoSpacing, 1.0, 1.0, 1.0);
  for (unsigned axis = 0; axis < 3; axis++) state_->volume->axis[axis].center = nrrdCenterNode;

  gageContext* context = gageContextNew();
  state_->contexts.push_back(context);
  gagePerVolume* volume = gagePerVolumeNew(context, state_->volume, gageKindScl);
  if (!volume || gagePerVolumeAttach(context, volume)) fail(GAGE);
  const double parameters[NRRD_KERNEL_PARMS_NUM] = {1.0, 1.0, 0.0};  // scale 1, B = 1, C = 0: the cubic B-spline
  bool bad = gageKernelSet(context, gageKernel00, nrrdKernelBCCubic, parameters);
  bad = bad || gageKernelSet(context, gageKernel11, nrrdKernelBCCubicD, parameters);
  bad = bad || gageKernelSet(context, gageKernel22, nrrdKernelBCCubicDD, parameters);
  for (int item :
       {gageSclValue, gageSclGradVec, gageSclHessian, gageSclK1, gageSclK2, gageSclGaussCurv, gageSclMeanCurv})
    bad = bad || gageQueryItemOn(context, volume, item);
  if (bad || gageUpdate(context)) fail(GAGE);
  for (unsigned thread = 1; thread < thread_count(); thread++) {
    gageContext* copy = gageContextCopy(context);
    if (!copy || gageUpdate(copy)) fail(GAGE);
    state_->contexts.push_back(copy);
  }
}

GageProbe::~GageProbe() = default;

void GageProbe::all_properties(std::span<const glm::vec3> points, GageAnswers& a) const {
  for (auto* column : {&a.value, &a.k1, &a.k2, &a.gauss, &a.mean}) column->resize(points.size());
  a.gradient.resize(points.size());
  a.hessian.resize(points.size());
  parallel_chunks(points.size(), 1024, [&](unsigned thread, std::size_t begin, std::size_t end) {
    gageContext* context = state_->contexts[thread];
    auto pointer = [&](int item) { return gageAnswerPointer(context, context->pvl[0], item); };
    const double *value = pointer(gageSclValue), *gradient = pointer(gageSclGradVec),
                 *hessian = pointer(gageSclHessian);
    const double *k1 = pointer(gageSclK1), *k2 = pointer(gageSclK2), *gauss = pointer(gageSclGaussCurv),
                 *mean = pointer(gageSclMeanCurv);
    for (std::size_t i = begin; i < end; i++) {
      gageProbe(context, points[i].x, points[i].y, points[i].z);
      a.value[i] = float(*value);
      a.k1[i] = float(*k1);
      a.k2[i] = float(*k2);
      a.gauss[i] = float(*gauss);
      a.mean[i] = float(*mean);
      a.gradient[i] = glm::vec3(gradient[0], gradient[1], gradient[2]);
      for (int column = 0; column < 3; column++)
        for (int row = 0; row < 3; row++) a.hessian[i][column][row] = float(hessian[3 * column + row]);
    }
  });
}

}  // namespace smurf::bench
