#include "bench/external/sandbox.hpp"

#include <unistd.h>

#include "bench/external/call_filter.hpp"

namespace tankrig {
namespace {

constexpr int kNobody = 65534;
constexpr std::uint64_t kTemporaryBytes = 64 << 20;  // of its /tmp

// The rest, with the file $1 open for it to read as descriptor 3.
constexpr const char* kWithFilter = R"(exec 3< "$1"; shift; exec "$@")";
constexpr const char* kFilter = "3";

// $1 is copied to $2 after the rest has ended well.
constexpr const char* kKeepResult =
    R"(made=$1 result=$2; shift 2; "$@" || exit $?; if [ -f "$made" ]; then cat -- "$made" > "$result"; fi)";

}  // namespace

std::vector<std::string> sandboxed(const Sandbox& sandbox, const std::vector<std::string>& command) {
  std::vector<std::string> words;
  const auto add = [&](std::initializer_list<std::string> more) { words.insert(words.end(), more); };
  write_call_filter(sandbox.filter);
  add({"/bin/sh", "-c", kWithFilter, "sh", sandbox.filter});
  if (::geteuid() == 0) {
    const std::string nobody = std::to_string(kNobody);
    add({"/usr/bin/setpriv", "--reuid", nobody, "--regid", nobody, "--clear-groups", "--no-new-privs", "--"});
  }
  add({"/usr/bin/bwrap", "--unshare-all", "--unshare-user", "--disable-userns", "--die-with-parent", "--new-session",
       "--cap-drop", "ALL", "--seccomp", kFilter});
  add({"--ro-bind", "/usr", "/usr", "--symlink", "usr/bin", "/bin", "--symlink", "usr/sbin", "/sbin"});
  add({"--symlink", "usr/lib", "/lib", "--symlink", "usr/lib64", "/lib64"});
  add({"--ro-bind-try", "/etc/alternatives", "/etc/alternatives"});  // where libblas.so.3 leads to
  add({"--proc", "/proc", "--dev", "/dev", "--size", std::to_string(kTemporaryBytes), "--tmpfs", "/tmp"});
  for (const auto& folder : sandbox.readable) add({"--ro-bind", folder, folder});
  add({"--size", std::to_string(sandbox.work_bytes), "--tmpfs", sandbox.work});
  add({"--bind", sandbox.result, sandbox.result, "--remount-ro", "/", "--chdir", sandbox.work, "--"});
  add({"/bin/sh", "-c", kKeepResult, "sh", sandbox.made, sandbox.result});
  words.insert(words.end(), command.begin(), command.end());
  return words;
}

}  // namespace tankrig
