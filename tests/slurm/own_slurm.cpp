#include "tests/slurm/own_slurm.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include "tests/program/program.hpp"

namespace fs = std::filesystem;

namespace tankrig::test {
namespace {

/// Two ports that are free now.
std::vector<int> free_ports() {
  std::vector<int> sockets, ports;
  for (int i = 0; i < 2; ++i) {
    const int s = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    socklen_t size = sizeof address;
    if (s < 0 || ::bind(s, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        ::getsockname(s, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no free port");
    sockets.push_back(s);
    ports.push_back(ntohs(address.sin_port));
  }
  for (const int s : sockets) ::close(s);
  return ports;
}

std::string host_name() {
  char name[256] = {};
  if (::gethostname(name, sizeof name - 1) != 0) throw std::runtime_error("this machine has no name");
  return name;
}

/// Nobody is asked who he is, nothing is accounted for, and the scheduler looks at once.
constexpr const char* kConfiguration = R"(ClusterName=tank
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/none
CredType=cred/none
SlurmctldPort={controller}
SlurmdPort={node}
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/node.pid
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
ReturnToService=2
SlurmdParameters=config_overrides
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1,bf_interval=1
NodeName=tank NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=tank Default=YES MaxTime=INFINITE State=UP
)";

}  // namespace

std::string why_no_slurm() {
  if (std::system("command -v slurmctld slurmd sbatch squeue >/dev/null") != 0)
    return "Slurm is not installed (Debian packages slurmctld, slurmd, slurm-client)";
  if (::geteuid() != 0) return "a node of Slurm needs root";
  return "";
}

OwnSlurm::OwnSlurm(const fs::path& folder) : folder_(folder) {
  fs::create_directories(folder / "state");
  fs::create_directories(folder / "spool");
  const std::vector<int> ports = free_ports();
  write_text(folder / "slurm.conf", fmt::format(fmt::runtime(kConfiguration), fmt::arg("host", host_name()),
                                                fmt::arg("folder", folder.string()), fmt::arg("controller", ports[0]),
                                                fmt::arg("node", ports[1])));
  ::setenv("SLURM_CONF", (folder / "slurm.conf").c_str(), 1);
  daemons_ = {start({"slurmctld", "-D"}, "controller.log"), start({"slurmd", "-D", "-N", "tank"}, "node.log")};
  // srun waits for its node; a job that cannot start is cancelled.
  if (std::system("timeout 120 srun --nodes=1 true >/dev/null 2>&1") != 0) {
    const std::string told = logs();
    throw std::runtime_error("Slurm runs no job:\n" + told);
  }
}

OwnSlurm::~OwnSlurm() {
  (void)!std::system("scancel --state=PENDING --me; scancel --state=RUNNING --me");
  for (const pid_t daemon : daemons_) ::kill(daemon, SIGTERM);
  for (const pid_t daemon : daemons_) ::waitpid(daemon, nullptr, 0);
  ::unsetenv("SLURM_CONF");
}

pid_t OwnSlurm::start(const std::vector<std::string>& command, const std::string& log) const {
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  if (!std::freopen((folder_ / log).c_str(), "w", stderr) || ::dup2(STDERR_FILENO, STDOUT_FILENO) < 0) ::_exit(126);
  ::execvp(words[0], words.data());
  ::_exit(127);
}

void OwnSlurm::wait_for(const std::string& job) const {
  // A job after it opens a pipe that this side blocks on.
  const std::string pipe = (folder_ / ("end-of-" + job)).string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  ASSERT_EQ(std::system(("sbatch --parsable --dependency=afterany:" + job + " --output=/dev/null --wrap 'echo > " +
                         pipe + "' >/dev/null")
                            .c_str()),
            0);
  EXPECT_EQ(read_text(pipe), "\n");
}

std::string OwnSlurm::logs() const { return read_text(folder_ / "controller.log") + read_text(folder_ / "node.log"); }

}  // namespace tankrig::test
