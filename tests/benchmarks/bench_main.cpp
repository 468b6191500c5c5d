// main() of every benchmark: a bound that is missed fails (exit 1), a peer that is not installed or a late machine
// skips (exit 77).
#include <benchmark/benchmark.h>

#include <string_view>

namespace {

class Verdict final : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs)
      if (run.error_occurred) (std::string_view(run.error_message).starts_with("skipped") ? skipped : failed) = true;
    ConsoleReporter::ReportRuns(runs);
  }
  bool skipped = false, failed = false;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  Verdict verdict;
  benchmark::RunSpecifiedBenchmarks(&verdict);
  return verdict.failed ? 1 : verdict.skipped ? 77 : 0;
}
