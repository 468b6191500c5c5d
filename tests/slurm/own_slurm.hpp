// A Slurm of the test's own: controller and one node on this machine, on ports that nobody has.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace tankrig::test {

/// Why there can be none here; empty: there can.
std::string why_no_slurm();

/// While it lives, SLURM_CONF names it: sbatch and squeue of this process and its children ask it alone.
class OwnSlurm {
 public:
  /// `folder`: new, for its configuration, state and logs.
  /// Errors: runtime_error if the node is not there in two minutes.
  explicit OwnSlurm(const std::filesystem::path& folder);
  ~OwnSlurm();
  OwnSlurm(const OwnSlurm&) = delete;
  OwnSlurm& operator=(const OwnSlurm&) = delete;

  /// Until every task of a job has ended, however it ended.
  void wait_for(const std::string& job) const;
  std::string logs() const;

 private:
  pid_t start(const std::vector<std::string>& command, const std::string& log) const;

  std::filesystem::path folder_;
  std::vector<pid_t> daemons_;
};

}  // namespace tankrig::test
