// A surface's buffers on one device and the source that answers for it.
//
// The source module "surface" defines, as kernels/grid/surface.inc does,
//   Surface, and surface_open(SurfaceBuffers), whose members are the buffers by their names;
//   surface_find_hits (kernels/batch/find_hits.inc) and surface_frame (kernels/batch/measure.inc);
//   of kinds with coordinates surface_nearest_to (kernels/entries/find_nearest.cl);
//   of kinds that leave rays open surface_finish_hits (kernels/batch/finish_hits.inc).
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "device/executor.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

class ResidentSurface {
 public:
  virtual ~ResidentSurface() = default;
  // Source modules by the name under which kernels include them; always "surface".
  virtual const std::map<std::string, std::string>& modules() const = 0;
  virtual const std::map<std::string, std::string>& defines() const = 0;
  // Always the same names, in the same order; a buffer that is not made yet is null.
  virtual BufferGroup buffers() const = 0;
  virtual std::size_t bytes() const = 0;
  // Called before properties are measured: what only they need may be made now.
  virtual void prepare_properties() {}
  // Called before walks: the same. Kinds that can be walked on name a module "walk" (kernels/walk/point.inc).
  virtual void prepare_walks() {}
  // Kinds whose search leaves rays open, and finishes them apart (kernels/batch/finish_hits.inc): words of room that
  // the finishing takes for each hit; 0 for others.
  virtual int room_words() const { return 0; }
  // Whether hits may be tangent or unresolved. Else searches that only count need not write statuses to slots.
  virtual bool flags_hits() const { return true; }
  // Whether hits are moved to where they are more exactly, after the search (kernels/batch/polish_hits.inc).
  virtual bool polishes() const { return false; }
  // Takes over another surface of the same kind over the same field; false if it cannot.
  virtual bool update(const SurfaceDefinition& definition) = 0;

  // A kernel that asks this surface.
  Program program(KernelId kernel) const { return {kernel, modules(), defines(), {{"surface", names_of(buffers())}}}; }
};

}  // namespace smurf
