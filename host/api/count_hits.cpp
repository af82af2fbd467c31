// Counts of flagged hits, as a list of all hits has them.
#include <vector>

#include "surfaces/hit_columns.hpp"
#include "surfaces/queries.hpp"

namespace smurf {

void count_flagged_rays(SurfaceQueries& queries, const RayBatch& rays, const CastOptions& options, HitList& hits) {
  auto &counts = HitColumns::counts(hits), &flagged = HitColumns::flagged(hits);
  std::vector<std::size_t> doubtful;
  for (std::size_t i = 0; i < flagged.size(); i++) {
    if (flagged[i] > 0) doubtful.push_back(i);
  }
  if (doubtful.empty()) return;
  RayBatch again(doubtful.size());
  for (std::size_t i = 0; i < doubtful.size(); i++) again.set(i, rays[doubtful[i]]);
  HitList all;
  queries.cast(again, {.hits = Hits::all, .tile = options.tile}, all);
  for (std::size_t i = 0; i < doubtful.size(); i++) {
    std::uint32_t total = 0, open = 0;
    for (std::size_t h = all.offsets()[i]; h < all.offsets()[i + 1]; h++) {
      const HitStatus status = all.status()[h];
      total++;
      open += status == HitStatus::tangent || status == HitStatus::unresolved ? 1 : 0;
    }
    const bool any = options.hits == Hits::any;
    counts[doubtful[i]] = any ? (total > 0 ? 1 : 0) : total;
    flagged[doubtful[i]] = any ? (total > 0 && open == total ? 1 : 0) : open;
  }
}

}  // namespace smurf
