// What the verbs that trace lines have in common.
#pragma once

#include "cli/commands.hpp"
#include "smurf/flow.hpp"

namespace smurf {

// Traces with progress. Says on standard error, unless quiet, how many seeds lie where there is no flow, and with -v
// what became of the lines.
Streamlines trace_lines(const Tracer& tracer, const FlowSeeds& seeds, TraceOptions options,
                        const CommonOptions& common);

}  // namespace smurf
