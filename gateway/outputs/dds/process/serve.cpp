// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/process/serve.h"

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::dds {
namespace {

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
#error "the numbers of system calls are not known here: see linux/audit.h"
#endif

/// System calls that a publisher on DDS never needs.
constexpr int kDenied[] = {SYS_execve,
                           SYS_execveat,
                           SYS_ptrace,
                           SYS_process_vm_readv,
                           SYS_process_vm_writev,
                           SYS_kill,
                           SYS_tkill,
                           SYS_rt_sigqueueinfo,
                           SYS_rt_tgsigqueueinfo,
                           SYS_pidfd_open,
                           SYS_pidfd_getfd,
                           SYS_pidfd_send_signal,
                           SYS_mount,
                           SYS_umount2,
                           SYS_pivot_root,
                           SYS_chroot,
                           SYS_setns,
                           SYS_unshare,
                           SYS_init_module,
                           SYS_finit_module,
                           SYS_delete_module,
                           SYS_kexec_load,
                           SYS_reboot,
                           SYS_swapon,
                           SYS_swapoff,
                           SYS_settimeofday,
                           SYS_clock_settime,
                           SYS_bpf,
                           SYS_perf_event_open,
                           SYS_keyctl,
                           SYS_add_key,
                           SYS_request_key,
                           SYS_userfaultfd,
                           SYS_io_uring_setup,
                           SYS_acct,
                           SYS_quotactl,
                           SYS_open_by_handle_at,
                           SYS_setuid,
                           SYS_setgid};

/// x86-64 has a second set of numbers for the same system calls (x32). It begins at this number, so
/// this number and all higher ones are refused.
constexpr std::uint32_t kOtherNumbers = 0x40000000;
constexpr std::uint32_t kRefuse = SECCOMP_RET_ERRNO | EPERM;

constexpr std::uint32_t Field(std::size_t offset) { return static_cast<std::uint32_t>(offset); }

class Filter {
 public:
  void Load(std::size_t offset) { Add(BPF_LD | BPF_W | BPF_ABS, Field(offset), 0, 0); }
  void Return(std::uint32_t what) { Add(BPF_RET | BPF_K, what, 0, 0); }
  /// Adds a jump over the next `skipped` instructions if the loaded value is not `value`.
  void SkipUnless(std::uint32_t value, std::uint8_t skipped) {
    Add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, skipped);
  }
  void SkipIf(std::uint32_t value, std::uint8_t skipped) {
    Add(BPF_JMP | BPF_JEQ | BPF_K, value, skipped, 0);
  }
  void RefuseFrom(std::uint32_t value) {
    Add(BPF_JMP | BPF_JGE | BPF_K, value, 0, 1);
    Return(kRefuse);
  }
  bool Install() {
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
  }

 private:
  void Add(int code, std::uint32_t k, std::uint8_t yes, std::uint8_t no) {
    code_.push_back({static_cast<std::uint16_t>(code), yes, no, k});
  }
  std::vector<sock_filter> code_;
};

/// Adds instructions that decide about the system call `call` by its first argument. `wanted` true:
/// all arguments except `value` are refused; false: only `value` is refused.
void JudgeArgument(Filter& filter, long call, std::uint32_t value, bool wanted) {
  filter.SkipUnless(static_cast<std::uint32_t>(call), 4);
  filter.Load(offsetof(seccomp_data, args));  // the lower half of the argument
  if (wanted) {
    filter.SkipIf(value, 1);
  } else {
    filter.SkipUnless(value, 1);
  }
  filter.Return(kRefuse);
  filter.Return(SECCOMP_RET_ALLOW);
}

}  // namespace

bool EndWith(pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  return ::getppid() == parent;
}

Status LimitMemory(std::uint64_t bytes) {
  const rlimit memory{bytes, bytes};
  const rlimit none{0, 0};
  if (::setrlimit(RLIMIT_AS, &memory) != 0 || ::setrlimit(RLIMIT_CORE, &none) != 0) {
    return Error{std::string("the memory limit of this process cannot be set: ") +
                 std::strerror(errno)};
  }
  return {};
}

Status DenyCalls() {
  Filter filter;
  filter.Load(offsetof(seccomp_data, arch));
  filter.SkipIf(kArchitecture, 1);
  filter.Return(SECCOMP_RET_KILL_PROCESS);
  filter.Load(offsetof(seccomp_data, nr));
  filter.RefuseFrom(kOtherNumbers);
  for (const int call : kDenied) {
    filter.SkipUnless(static_cast<std::uint32_t>(call), 1);
    filter.Return(kRefuse);
  }
  // The process is allowed to send a signal to itself by tgkill, because abort() needs it.
  JudgeArgument(filter, SYS_tgkill, static_cast<std::uint32_t>(::getpid()), true);
  JudgeArgument(filter, SYS_socket, AF_UNIX, false);
  filter.Return(SECCOMP_RET_ALLOW);
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || !filter.Install()) {
    return Error{std::string("the system call filter cannot be installed: ") +
                 std::strerror(errno)};
  }
  return {};
}

namespace {

// The longest delay until a changed number of subscribers is reported.
constexpr Duration kLook = 100ms;
constexpr int kMostPacketsAtOnce = 256;

/// Sends the waiting requests to the gateway. A request for which the socket has no space stays in
/// `held`. False: the gateway has closed the link.
bool SendRequests(const Descriptor& link, LinkServer& server, std::optional<Bytes>& held) {
  for (;;) {
    if (!held) held = server.NextRequest();
    if (!held) return true;
    const PacketSent sent = SendPacket(link.get(), *held);
    if (sent == PacketSent::closed) return false;
    if (sent == PacketSent::full) return true;
    held.reset();
  }
}

ServeEnd TakeLeave(const Descriptor& link, LinkServer& server, ServeEnd why) {
  while (const auto next = server.Leave(ReadClocks().instant)) std::this_thread::sleep_until(*next);
  if (const auto left = server.Answer(ReadClocks().instant)) SendPacket(link.get(), *left);
  return why;
}

}  // namespace

WakeUp::WakeUp() : event_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

void WakeUp::Ring() const {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(event_.get(), &one, sizeof one);
}

void WakeUp::Clear() const {
  std::uint64_t rung = 0;
  [[maybe_unused]] const auto read = ::read(event_.get(), &rung, sizeof rung);
}

Result<ServeEnd> Serve(const Descriptor& link, LinkServer& server, const WakeUp& wake, int stop,
                       const std::function<Status()>& alive) {
  const auto buffer = std::make_unique<PacketBuffer>();
  const auto leave = [&](ServeEnd why) { return TakeLeave(link, server, why); };
  std::array<pollfd, 3> waited{
      {{link.get(), POLLIN, 0}, {stop, POLLIN, 0}, {wake.descriptor(), POLLIN, 0}}};
  std::optional<Bytes> held;
  Instant next_alive{};
  for (;;) {
    for (int i = 0; i < kMostPacketsAtOnce; ++i) {
      const ReceivedPacket received = ReceivePacket(link.get(), *buffer);
      if (received.got == PacketGot::nothing_yet) break;
      if (received.got == PacketGot::closed) return leave(ServeEnd::closed);
      if (const Status status = server.Take(received.packet); !status) return Error{status.error()};
      if (server.ended()) return leave(ServeEnd::ended);
    }
    wake.Clear();
    if (!SendRequests(link, server, held)) return leave(ServeEnd::closed);
    const Instant now = ReadClocks().instant;
    if (const auto answer = server.Answer(now)) {
      // If the socket is full, this answer is lost. Counts are sent again with the next answer.
      if (SendPacket(link.get(), *answer) == PacketSent::closed) return leave(ServeEnd::closed);
    }
    if (now >= next_alive) {
      next_alive = now + 1s;
      if (const Status status = alive(); !status) return Error{status.error()};
    }
    ::poll(waited.data(), waited.size(), static_cast<int>(kLook / 1ms));
    if ((waited[1].revents & POLLIN) != 0) return leave(ServeEnd::stopped);
  }
}

}  // namespace baudgate::dds
