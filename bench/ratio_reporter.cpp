#include "ratio_reporter.hpp"

#include <fmt/format.h>

#include <cstdio>

namespace smurf::bench {

bool is_peer(const std::string& who) {
  return who.starts_with("embree") || who.starts_with("gage") || who.starts_with("vtk") || who == "reference";
}

RatioReporter::RatioReporter() : inner_(benchmark::CreateDefaultDisplayReporter()) {}

bool RatioReporter::ReportContext(const Context& context) {
  inner_->SetOutputStream(&GetOutputStream());
  inner_->SetErrorStream(&GetErrorStream());
  return inner_->ReportContext(context);
}

void RatioReporter::ReportRuns(const std::vector<Run>& runs) {
  std::vector<Run> shown;
  for (const Run& run : runs) {
    if (run.run_type == Run::RT_Aggregate && run.aggregate_name != "median") continue;
    if (run.error_occurred && run.repetition_index > 0) continue;  // once is enough
    shown.push_back(run);
    const auto rate = run.counters.find("items_per_second"), core_rate = run.counters.find("items_per_core_second");
    if (run.run_type != Run::RT_Aggregate || rate == run.counters.end() || core_rate == run.counters.end()) continue;
    const std::string& name = run.run_name.function_name;
    const auto second = name.find('/', name.find('/') + 1);
    if (second == std::string::npos) continue;
    rates_[name.substr(0, second)].push_back({name.substr(second + 1), rate->second.value, core_rate->second.value});
  }
  if (!shown.empty()) inner_->ReportRuns(shown);
}

void RatioReporter::Finalize() {
  inner_->Finalize();
  for (const auto& [task, entries] : rates_) {
    std::vector<Entry> peers;
    for (const Entry& entry : entries)
      if (is_peer(entry.who)) peers.push_back(entry);
    std::string line = fmt::format("\n{:<36} {:>9} {:>9}", task + ", median", "M/s", "M/core-s");
    for (const Entry& peer : peers) line += fmt::format("  {:>16}", "x " + peer.who);
    for (const Entry& entry : entries) {
      line += fmt::format("\n  {:<34} {:>9.4g} {:>9.4g}", entry.who, 1e-6 * entry.rate, 1e-6 * entry.core_rate);
      for (const Entry& peer : peers) line += fmt::format("  {:>16.3g}", entry.rate / peer.rate);
    }
    fmt::print(stderr, "{}\n", line);
  }
}

}  // namespace smurf::bench
