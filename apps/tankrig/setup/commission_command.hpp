// `tankrig doctor --commission`: the daily start-up test, run by a person.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tankrig::app {

struct CommissionOptions {
  std::string operator_name, carrier;
  std::vector<std::string> waived;  ///< names of steps
  double wait_s = 60;               ///< for each thing that is asked for
  bool yes = false;
};

/// kOk: passed; kPartial: stopped; kFailure: a step failed. Either way it is on record.
int run_commission(const std::string& rig, const std::filesystem::path& sessions, const CommissionOptions& options,
                   bool json);

/// Names for --waive.
std::vector<std::string> waivable_steps();

}  // namespace tankrig::app
