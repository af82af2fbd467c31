// smurf-sisl PATCHES.bpt RAYS.csv HITS.csv: hits that smurf has told (`smurf cast ... --hits all -o HITS.csv`), held
// against those of SISL (s1856, surface and line), ray by ray: how many rays differ in their number, and how far t is
// off. Says how long SISL took, one thread.
//
// SISL is AGPL. This is a program of its own, which shares no code with smurf and is built only with SMURF_BENCH_SISL.
#include <sisl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Vector = std::array<double, 3>;

struct Surface {
  SISLSurf* surface = nullptr;
  Vector lower{}, upper{};
};

struct Ray {
  Vector origin{}, direction{};
};

[[noreturn]] void fail(const std::string& message) {
  std::cerr << "smurf-sisl: " << message << "\n";
  std::exit(2);
}

// Rows of numbers by the names of a header. Words are 0.
std::map<std::string, std::vector<double>> read_table(const std::string& file) {
  std::ifstream stream(file);
  std::string line, cell;
  if (!std::getline(stream, line)) fail("\"" + file + "\" cannot be read, or is empty");
  std::vector<std::string> names;
  for (std::istringstream header(line); std::getline(header, cell, ',');) names.push_back(cell);
  std::map<std::string, std::vector<double>> table;
  while (std::getline(stream, line)) {
    std::istringstream row(line);
    for (const std::string& name : names) {
      std::getline(row, cell, ',');
      table[name].push_back(std::strtod(cell.c_str(), nullptr));
    }
  }
  return table;
}

// Bézier patches: their number, then of each its degrees and points, u fastest.
std::vector<Surface> read_patches(const std::string& file) {
  std::ifstream stream(file);
  std::size_t count = 0;
  if (!(stream >> count)) fail("\"" + file + "\" is no .bpt file");
  std::vector<Surface> surfaces;
  for (std::size_t i = 0; i < count; i++) {
    int degree_u = 0, degree_v = 0;
    stream >> degree_u >> degree_v;
    const int order_u = degree_u + 1, order_v = degree_v + 1;
    std::vector<double> points(std::size_t(3 * order_u * order_v));
    for (double& x : points) stream >> x;
    if (!stream) fail("\"" + file + "\" ends early");
    Surface s;
    s.lower.fill(HUGE_VAL);
    s.upper.fill(-HUGE_VAL);
    for (std::size_t k = 0; k < points.size(); k++) {
      s.lower[k % 3] = std::min(s.lower[k % 3], points[k]);
      s.upper[k % 3] = std::max(s.upper[k % 3], points[k]);
    }
    std::vector<double> knots_u(std::size_t(order_u), 0.0), knots_v(std::size_t(order_v), 0.0);
    knots_u.resize(std::size_t(2 * order_u), 1.0);
    knots_v.resize(std::size_t(2 * order_v), 1.0);
    s.surface = newSurf(order_u, order_v, order_u, order_v, knots_u.data(), knots_v.data(), points.data(), 1, 3, 1);
    if (!s.surface) fail("SISL refuses a patch");
    surfaces.push_back(s);
  }
  return surfaces;
}

bool meets(const Ray& ray, const Surface& s) {
  double enter = -HUGE_VAL, leave = HUGE_VAL;
  for (std::size_t a = 0; a < 3; a++) {
    const double margin = 1e-6;
    if (ray.direction[a] == 0) {
      if (ray.origin[a] < s.lower[a] - margin || ray.origin[a] > s.upper[a] + margin) return false;
      continue;
    }
    const double t0 = (s.lower[a] - margin - ray.origin[a]) / ray.direction[a],
                 t1 = (s.upper[a] + margin - ray.origin[a]) / ray.direction[a];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave;
}

void add_hits(const Ray& ray, const Surface& s, std::vector<double>& hits) {
  Vector origin = ray.origin, direction = ray.direction;
  int count = 0, curves = 0, status = 0;
  double* parameters = nullptr;
  SISLIntcurve** curve = nullptr;
  s1856(s.surface, origin.data(), direction.data(), 3, 0.0, 1e-9, &count, &parameters, &curves, &curve, &status);
  if (status < 0) fail("s1856 fails with " + std::to_string(status));
  double square = 0;
  for (const double d : direction) square += d * d;
  for (int i = 0; i < count; i++) {
    int left_u = 0, left_v = 0;
    std::array<double, 3> place{}, normal{};
    s1421(s.surface, 0, parameters + std::ptrdiff_t(2 * i), &left_u, &left_v, place.data(), normal.data(), &status);
    double t = 0;
    for (std::size_t a = 0; a < 3; a++) t += (place[a] - origin[a]) * direction[a];
    if (t >= 0) hits.push_back(t / square);
  }
  std::free(parameters);
  if (curves > 0) freeIntcrvlist(curve, curves);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) fail("usage: smurf-sisl PATCHES.bpt RAYS.csv HITS.csv");
  const std::vector<Surface> surfaces = read_patches(arguments[1]);
  auto rays = read_table(arguments[2]), told = read_table(arguments[3]);
  const std::size_t size = rays["ox"].size();
  if (size == 0 || (!told.empty() && told["ray"].empty())) fail("there are no rays, or HITS.csv has no column \"ray\"");
  std::vector<std::vector<double>> found(size);
  for (std::size_t i = 0; i < told["ray"].size(); i++) found[std::size_t(told["ray"][i])].push_back(told["t"][i]);

  std::size_t hits = 0, differing = 0;
  double worst = 0, seconds = 0;
  std::vector<double> exact;
  for (std::size_t i = 0; i < size; i++) {
    const Ray ray{{rays["ox"][i], rays["oy"][i], rays["oz"][i]}, {rays["dx"][i], rays["dy"][i], rays["dz"][i]}};
    const auto start = std::chrono::steady_clock::now();
    exact.clear();
    for (const Surface& s : surfaces) {
      if (meets(ray, s)) add_hits(ray, s, exact);
    }
    std::ranges::sort(exact);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    hits += exact.size();
    if (exact.size() != found[i].size()) {
      if (differing++ < 10) {
        std::printf("ray %zu: SISL has %zu hits, HITS.csv %zu; t", i, exact.size(), found[i].size());
        for (const double t : exact) std::printf(" %.9g", t);
        std::printf(" |");
        for (const double t : found[i]) std::printf(" %.9g", t);
        std::printf("\n");
      }
      continue;
    }
    double length = 0;
    for (const double d : ray.direction) length += d * d;
    for (std::size_t k = 0; k < exact.size(); k++)
      worst = std::max(worst, std::abs(exact[k] - found[i][k]) * std::sqrt(length));
  }
  std::printf("%zu rays, %zu hits: %zu rays differ in number; locations differ by %.2g at most; SISL %.4f Mrays/s\n",
              size, hits, differing, worst, double(size) / seconds / 1e6);
  for (const Surface& s : surfaces) freeSurf(s.surface);
  return differing == 0 ? 0 : 1;
}
