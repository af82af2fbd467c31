#include "ratio_reporter.hpp"

#include <fmt/format.h>

#include <cstdio>

namespace smurf::bench {

bool is_peer(const std::string& who) {
  return who.starts_with("embree") || who.starts_with("gage") || who == "reference";
}

RatioReporter::RatioReporter() : inner_(benchmark::CreateDefaultDisplayReporter()) {}

bool RatioReporter::ReportContext(const Context& context) {
  inner_->SetOutputStream(&GetOutputStream());
  inner_->SetErrorStream(&GetErrorStream());
  return inner_->ReportContext(context);
}

void RatioReporter::ReportRuns(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    const auto counter = run.counters.find("items_per_second");
    if (run.run_type != Run::RT_Aggregate || run.aggregate_name != "median" || counter == run.counters.end()) continue;
    const std::string& name = run.run_name.function_name;
    const auto second = name.find('/', name.find('/') + 1);
    if (second != std::string::npos)
      rates_[name.substr(0, second)].push_back({name.substr(second + 1), counter->second.value});
  }
  inner_->ReportRuns(runs);
}

void RatioReporter::Finalize() {
  inner_->Finalize();
  for (const auto& [task, entries] : rates_) {
    std::vector<Entry> peers;
    for (const Entry& entry : entries)
      if (is_peer(entry.who)) peers.push_back(entry);
    std::string line = fmt::format("\n{:<36} {:>9}", task + ", median", "M/s");
    for (const Entry& peer : peers) line += fmt::format("  {:>16}", "x " + peer.who);
    for (const Entry& entry : entries) {
      line += fmt::format("\n  {:<34} {:>9.4g}", entry.who, 1e-6 * entry.rate);
      for (const Entry& peer : peers) line += fmt::format("  {:>16.3g}", entry.rate / peer.rate);
    }
    fmt::print(stderr, "{}\n", line);
  }
}

}  // namespace smurf::bench
