#include "reconstruction/stripe/find/stripe_path.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {
namespace {

constexpr int kLookBack = 4;  ///< columns a run may miss, plus one
constexpr double kRunPrice = 3.0;
constexpr double kMissPrice = 0.25;  ///< of a missing column
constexpr double kStepPrice = 0.3;   ///< of the largest step
constexpr double kLeastGain = 1.2;
constexpr double kGainBeyond = 0.1;  ///< slope above the limit, so that the stronger of two lines wins

struct Node {
  double value = 0;
  int previous = -1;  ///< node before this one on the best path, -1 none
  bool starts_run = true;
};

double gain(float snr, double min_snr, double enough) {
  const double evidence = std::log(snr / static_cast<float>(min_snr));
  return std::min(evidence, enough) + kGainBeyond * std::max(0.0, evidence - enough);
}

constexpr int kK = RidgeCandidates::kPerColumn;
constexpr int kBefore = kLookBack * kK;  ///< candidates that one may follow

/// joined[i]: whether any of the kBefore rows ahead of the i-th is as near to it as the columns between allow. `rows`: as
/// many candidates in every column, infinite where there is none.
TANKRIG_VECTORISED
void mark_joined(const float* rows, int count, float max_step_px, std::uint8_t* joined) {
  static_assert(kBefore == 16 && kK == 4);
  const float a = max_step_px, b = 2 * a, c = 3 * a, d = 4 * a;
  alignas(sizeof(EightFloats)) const EightFloats reach[] = {{d, d, d, d, c, c, c, c}, {b, b, b, b, a, a, a, a}};
  for (int i = 0; i < count; ++i) {
    EightInts near = {};
    for (int half = 0; half < 2; ++half) {
      EightFloats apart;
      std::memcpy(&apart, rows + i - i % kK - kBefore + 8 * half, sizeof apart);
      apart -= rows[i];
      near |= (apart <= reach[half]) & (apart >= -reach[half]);
    }
    std::uint64_t parts[4], all = 0;
    std::memcpy(parts, &near, sizeof near);
    for (const std::uint64_t part : parts) all |= part;
    joined[i] = all != 0;
  }
}

std::vector<std::uint8_t> joined_candidates(const RidgeCandidates& candidates, double max_step_px) {
  const auto count = static_cast<std::size_t>(candidates.columns()) * kK;
  std::vector<float> rows(kBefore + count, HUGE_VALF);
  for (int column = 0; column < candidates.columns(); ++column)
    for (int k = 0; k < candidates.count(column); ++k)
      rows[kBefore + static_cast<std::size_t>(column) * kK + k] = candidates.at(column, k).row;
  std::vector<std::uint8_t> joined(count);
  const float reach = std::nextafter(static_cast<float>(max_step_px), HUGE_VALF);
  mark_joined(rows.data() + kBefore, static_cast<int>(count), reach, joined.data());
  return joined;
}

}  // namespace

std::vector<StripeRun> best_path(const RidgeCandidates& candidates, double min_snr, double max_step_px,
                                 double typical_snr) {
  const double enough = std::max(kLeastGain, std::log(typical_snr / min_snr));
  const std::vector<std::uint8_t> joined = joined_candidates(candidates, max_step_px);
  std::vector<Node> nodes(static_cast<std::size_t>(candidates.columns()) * kK);
  double ended_value = 0;  // best path that has left its last run before this column
  int ended_node = -1;
  for (int column = 0; column < candidates.columns(); ++column) {
    double best_here = ended_value;
    int best_node = ended_node;
    for (int k = 0; k < candidates.count(column); ++k) {
      const RidgeCandidate& here = candidates.at(column, k);
      Node node{ended_value - kRunPrice, ended_node, true};
      for (int back = 1; joined[column * kK + k] && back <= std::min(kLookBack, column); ++back) {
        const double reach = max_step_px * back;
        for (int j = 0; j < candidates.count(column - back); ++j) {
          const double step = std::abs(here.row - candidates.at(column - back, j).row);
          if (step > reach) continue;
          const int from = (column - back) * kK + j;
          const double value = nodes[from].value - kStepPrice * step / reach - kMissPrice * (back - 1);
          if (value > node.value) node = {value, from, false};
        }
      }
      node.value += gain(here.snr, min_snr, enough);
      nodes[column * kK + k] = node;
      if (node.value > best_here) {
        best_here = node.value;
        best_node = column * kK + k;
      }
    }
    ended_value = best_here;
    ended_node = best_node;
  }
  std::vector<StripeRun> runs;
  bool new_run = true;
  for (int at = ended_node; at >= 0; at = nodes[at].previous) {
    if (new_run) runs.emplace_back();
    runs.back().push_back({at / kK, candidates.at(at / kK, at % kK)});
    new_run = nodes[at].starts_run;
  }
  std::reverse(runs.begin(), runs.end());
  for (StripeRun& run : runs) std::reverse(run.begin(), run.end());
  return runs;
}

}  // namespace tankrig
