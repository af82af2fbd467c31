// A vector field as the host knows it, whatever its kind: no device, no kernel, no reference. One class per kind
// derives from VectorFieldDefinition.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "numerics/fact.hpp"
#include "smurf/flow.hpp"

namespace smurf {

enum class FlowKind {
#define FLOW_KIND(name) name,
#include "flows/kinds.def"
};

class VectorFieldDefinition {
 public:
  explicit VectorFieldDefinition(FlowKind the_family) : family(the_family) {}
  virtual ~VectorFieldDefinition() = default;

  const FlowKind family;
  virtual std::string_view kind() const = 0;  // as descriptions name it
  virtual Bounds bounds() const = 0;
  // How many derivatives are continuous, for what asks for them: 0 trilinear, 2 and more else.
  virtual int smoothness() const = 0;
  // Of the samples; NaN where that is not known.
  virtual double greatest_speed() const = 0;
  // A bound of |D²v[a, a]| for |a| = 1 in a box; infinite where none is known. May be called by threads at once.
  virtual double greatest_bend(const Bounds& box) const;
  virtual std::vector<Fact> facts() const = 0;

  // Told beside the facts: how the field was read from a file. What reads it sets them, before anyone else has the
  // field.
  const std::vector<Fact>& notes() const { return notes_; }
  void set_notes(std::vector<Fact> notes) const { notes_ = std::move(notes); }

 private:
  mutable std::vector<Fact> notes_;
};

inline double VectorFieldDefinition::greatest_bend(const Bounds&) const {
  return std::numeric_limits<double>::infinity();
}

}  // namespace smurf
