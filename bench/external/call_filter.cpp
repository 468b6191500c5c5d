#include "bench/external/call_filter.hpp"

#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr int kNotThere[] = {
    // programs in the kernel, and the kernel itself
    SCMP_SYS(bpf), SCMP_SYS(init_module), SCMP_SYS(finit_module), SCMP_SYS(delete_module), SCMP_SYS(kexec_load),
    SCMP_SYS(kexec_file_load), SCMP_SYS(reboot), SCMP_SYS(syslog), SCMP_SYS(iopl), SCMP_SYS(ioperm),
    SCMP_SYS(modify_ldt), SCMP_SYS(personality), SCMP_SYS(lookup_dcookie), SCMP_SYS(uselib),
    // keys
    SCMP_SYS(add_key), SCMP_SYS(request_key), SCMP_SYS(keyctl),
    // other processes
    SCMP_SYS(ptrace), SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev), SCMP_SYS(process_madvise),
    SCMP_SYS(kcmp), SCMP_SYS(pidfd_getfd),
    // what watches, and handles the faults of others
    SCMP_SYS(perf_event_open), SCMP_SYS(userfaultfd), SCMP_SYS(fanotify_init), SCMP_SYS(fanotify_mark),
    // namespaces (clone3 hides its flags: the C library then calls clone), mounts
    SCMP_SYS(unshare), SCMP_SYS(setns), SCMP_SYS(clone3), SCMP_SYS(mount), SCMP_SYS(umount), SCMP_SYS(umount2),
    SCMP_SYS(pivot_root), SCMP_SYS(chroot), SCMP_SYS(move_mount), SCMP_SYS(open_tree), SCMP_SYS(fsopen),
    SCMP_SYS(fsconfig), SCMP_SYS(fsmount), SCMP_SYS(fspick), SCMP_SYS(mount_setattr),
    // a file by its number
    SCMP_SYS(name_to_handle_at), SCMP_SYS(open_by_handle_at),
    // rings that make calls no filter sees
    SCMP_SYS(io_uring_setup), SCMP_SYS(io_uring_enter), SCMP_SYS(io_uring_register),
    // pages that are moved or lent
    SCMP_SYS(migrate_pages), SCMP_SYS(move_pages), SCMP_SYS(mbind), SCMP_SYS(set_mempolicy), SCMP_SYS(vmsplice),
    // this machine's clock, name, swap and accounts
    SCMP_SYS(adjtimex), SCMP_SYS(clock_adjtime), SCMP_SYS(clock_settime), SCMP_SYS(settimeofday), SCMP_SYS(stime),
    SCMP_SYS(sethostname), SCMP_SYS(setdomainname), SCMP_SYS(swapon), SCMP_SYS(swapoff), SCMP_SYS(acct),
    SCMP_SYS(quotactl), SCMP_SYS(quotactl_fd), SCMP_SYS(vhangup)};

constexpr unsigned kNewNamespaces[] = {CLONE_NEWNS,   CLONE_NEWCGROUP, CLONE_NEWUTS, CLONE_NEWIPC,
                                       CLONE_NEWUSER, CLONE_NEWPID,    CLONE_NEWNET};

constexpr std::uint32_t kNoCall = SCMP_ACT_ERRNO(ENOSYS), kNoFamily = SCMP_ACT_ERRNO(EAFNOSUPPORT);
constexpr scmp_datum_t kInt = 0xffffffff;  // of an argument that the kernel takes as an int

}  // namespace

void write_call_filter(const std::filesystem::path& file) {
  const std::unique_ptr<void, decltype(&::seccomp_release)> filter(::seccomp_init(SCMP_ACT_ALLOW), &::seccomp_release);
  int problem = filter ? 0 : -ENOMEM;
  const auto add = [&](std::uint32_t instead, int call, auto... when) {
    if (problem == 0) problem = ::seccomp_rule_add(filter.get(), instead, call, sizeof...(when), when...);
  };
  for (const int call : kNotThere) add(kNoCall, call);
  for (const unsigned flag : kNewNamespaces) add(kNoCall, SCMP_SYS(clone), SCMP_A0(SCMP_CMP_MASKED_EQ, flag, flag));
  add(kNoCall, SCMP_SYS(ioctl), SCMP_A1(SCMP_CMP_MASKED_EQ, kInt, TIOCSTI));  // types into a terminal
  for (const int call : {SCMP_SYS(socket), SCMP_SYS(socketpair)}) add(kNoFamily, call, SCMP_A0(SCMP_CMP_NE, AF_UNIX));
  const int out = problem == 0 ? ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600) : -1;
  if (problem == 0) problem = out < 0 ? -errno : ::seccomp_export_bpf(filter.get(), out);
  if (out >= 0 && ::close(out) != 0 && problem == 0) problem = -errno;
  if (problem != 0) throw InputError(file, std::string("filter of system calls: ") + std::strerror(-problem));
}

}  // namespace tankrig
