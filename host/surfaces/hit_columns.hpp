// The columns of a hit list by turns, for whoever makes, moves or writes rows (smurf/hit_columns.def declares them).
#pragma once

#include <string_view>
#include <utility>

#include "smurf/interrogator.hpp"

namespace smurf {

// One row: a member for each column.
struct HitRow {
#define HIT_COLUMN(name, type, names, place) type name;
#include "smurf/hit_columns.def"
};

struct HitColumns {
#define HIT_COLUMN(name, type, names, place) \
  static auto& name(auto& hits) { return hits.name##_; }
#include "smurf/hit_columns.def"
  static auto& offsets(auto& hits) { return hits.offsets_; }
  static auto& ray_status(auto& hits) { return hits.ray_status_; }
  static auto& counts(auto& hits) { return hits.counts_; }
  static auto& flagged(auto& hits) { return hits.flagged_; }
  static PointProperties& properties(HitList& hits) { return hits.properties_; }

  // Whether a column has rows; of kinds without surface coordinates that of coordinates has none.
  static bool has_rows(std::string_view column, bool coordinates) { return coordinates || column != "coordinates"; }

  // visit(column, member of HitRow) for each column that has rows.
  template <class List, class Visit>
  static void each(List& hits, bool coordinates, Visit&& visit) {
#define HIT_COLUMN(name, type, names, place) \
  if (has_rows(#name, coordinates)) visit(hits.name##_, &HitRow::name);
#include "smurf/hit_columns.def"
  }

  static void set(HitList& hits, bool coordinates, std::size_t at, const HitRow& row) {
    each(hits, coordinates, [&](auto& column, auto member) { column[at] = row.*member; });
  }
  static void append(HitList& hits, bool coordinates, const HitRow& row) {
    each(hits, coordinates, [&](auto& column, auto member) { column.push_back(row.*member); });
  }
  static HitRow row(const HitList& hits, bool coordinates, std::size_t at) {
    HitRow row{};
    each(hits, coordinates, [&](const auto& column, auto member) { row.*member = column[at]; });
    return row;
  }

  // As a list is without rays.
  static void clear(HitList& hits) {
    each(hits, true, [](auto& column, auto) { column.clear(); });
    hits.offsets_.assign(1, 0);
    hits.ray_status_.clear();
    hits.counts_.clear();
    hits.flagged_.clear();
    hits.properties_ = {};
    hits.principal_.clear();
  }
};

}  // namespace smurf
