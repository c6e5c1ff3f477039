// Runs a program under the restrictions of a systemd unit, as far as a process can restrict itself.
// SIGSYS ends the program where systemd would return an error, so that no refusal goes unnoticed
// (one exception: see Apply). For mounts, devices and users see docs/boot-test.md.
// Usage: sandboxed UNIT PROGRAM [ARGUMENT…]
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Words = std::vector<std::string>;
using Directives = std::map<std::string, std::vector<Words>>;

constexpr int kCannot = 125;

/// Each directive of the unit must be in one of these two sets. So a new directive is not
/// forgotten.
const std::set<std::string> kAppliedHere = {"LockPersonality",
                                            "MemoryDenyWriteExecute",
                                            "NoNewPrivileges",
                                            "RestrictAddressFamilies",
                                            "RestrictNamespaces",
                                            "RestrictRealtime",
                                            "RestrictSUIDSGID",
                                            "SystemCallArchitectures",
                                            "SystemCallErrorNumber",
                                            "SystemCallFilter",
                                            "UMask"};
const std::set<std::string> kNeedSystemd = {"AmbientCapabilities",
                                            "CapabilityBoundingSet",
                                            "DeviceAllow",
                                            "DevicePolicy",
                                            "Environment",
                                            "ExecReload",
                                            "ExecStart",
                                            "Group",
                                            "KeyringMode",
                                            "LimitCORE",
                                            "LimitNOFILE",
                                            "MemoryMax",
                                            "MemorySwapMax",
                                            "PrivateMounts",
                                            "PrivateTmp",
                                            "ProtectClock",
                                            "ProtectControlGroups",
                                            "ProtectHome",
                                            "ProtectHostname",
                                            "ProtectKernelLogs",
                                            "ProtectKernelModules",
                                            "ProtectKernelTunables",
                                            "ProtectProc",
                                            "ProtectSystem",
                                            "RemoveIPC",
                                            "Restart",
                                            "RestartPreventExitStatus",
                                            "RestartSec",
                                            "RuntimeDirectory",
                                            "StateDirectory",
                                            "StateDirectoryMode",
                                            "SupplementaryGroups",
                                            "TimeoutStopSec",
                                            "Type",
                                            "User",
                                            "WatchdogSec",
                                            "WorkingDirectory"};

[[noreturn]] void Give(const std::string& why) {
  std::cerr << "sandboxed: " << why << '\n';
  std::exit(kCannot);
}

Words WordsOf(const std::string& text) {
  std::istringstream stream(text);
  Words words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

Directives ReadUnit(const std::string& file) {
  std::ifstream unit(file);
  if (!unit) Give("no unit " + file);
  Directives directives;
  bool service = false;
  for (std::string line; std::getline(unit, line);) {
    if (line.starts_with('[')) service = line == "[Service]";
    const std::size_t equals = line.find('=');
    if (!service || line.starts_with('#') || equals == std::string::npos) continue;
    const std::string name = line.substr(0, equals);
    if (!kAppliedHere.contains(name) && !kNeedSystemd.contains(name)) {
      Give(name + "= is new: say in sandboxed.cpp whether it is tried here or by the boot test");
    }
    directives[name].push_back(WordsOf(line.substr(equals + 1)));
  }
  return directives;
}

bool IsOn(const Directives& directives, const std::string& name) {
  const auto found = directives.find(name);
  return found != directives.end() && found->second.back() == Words{"yes"};
}

void AddGroup(const std::string& group, std::set<std::string>& calls) {
  const std::string command = "systemd-analyze syscall-filter " + group;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  if (!pipe) Give("systemd-analyze does not start");
  std::size_t lines = 0;
  std::vector<std::string> nested;
  for (char line[256]; std::fgets(line, sizeof line, pipe.get()) != nullptr; ++lines) {
    const Words words = WordsOf(line);
    if (lines == 0 || words.empty() || words[0] == "#") continue;
    words[0].starts_with('@') ? nested.push_back(words[0]) : (void)calls.insert(words[0]);
  }
  if (lines == 0) Give("no group " + group);
  for (const std::string& one : nested) AddGroup(one, calls);
}

std::set<std::string> AllowedCalls(const std::vector<Words>& lines) {
  std::set<std::string> allowed;
  AddGroup("@default", allowed);
  for (const Words& line : lines) {
    const bool without = line.at(0).starts_with('~');
    for (std::string word : line) {
      if (word.starts_with('~')) word.erase(0, 1);
      std::set<std::string> calls;
      word.starts_with('@') ? AddGroup(word, calls) : (void)calls.insert(word);
      for (const std::string& call : calls) {
        without ? (void)allowed.erase(call) : (void)allowed.insert(call);
      }
    }
  }
  return allowed;
}

class Filter {
 public:
  explicit Filter(std::uint32_t otherwise)
      : context_(::seccomp_init(otherwise), ::seccomp_release) {}
  template <typename... Compared>
  void Add(std::uint32_t action, int call, Compared... compared) {
    const int failed =
        ::seccomp_rule_add(context_.get(), action, call, sizeof...(compared), compared...);
    if (failed != 0) Give(std::string("a rule: ") + std::strerror(-failed));
  }
  void Load() {
    if (const int failed = ::seccomp_load(context_.get()); failed != 0) {
      Give(std::string("a filter: ") + std::strerror(-failed));
    }
  }

 private:
  std::unique_ptr<void, void (*)(void*)> context_;
};

constexpr std::uint32_t kEnd = SCMP_ACT_KILL_PROCESS;

scmp_arg_cmp Has(unsigned argument, std::uint64_t bits) {
  return {argument, SCMP_CMP_MASKED_EQ, bits, bits};
}

int FamilyNamed(const std::string& name) {
  static const std::map<std::string, int> kFamilies = {{"AF_UNIX", AF_UNIX},
                                                       {"AF_INET", AF_INET},
                                                       {"AF_INET6", AF_INET6},
                                                       {"AF_NETLINK", AF_NETLINK}};
  const auto found = kFamilies.find(name);
  if (found == kFamilies.end()) Give("unknown family " + name);
  return found->second;
}

void AddFamilies(const std::vector<Words>& lines, Filter& filter) {
  std::set<int> allowed;
  for (const Words& line : lines) {
    for (const std::string& name : line) allowed.insert(FamilyNamed(name));
  }
  for (int family = 0; family < AF_MAX; ++family) {
    if (allowed.contains(family)) continue;
    filter.Add(kEnd, SCMP_SYS(socket),
               scmp_arg_cmp{0, SCMP_CMP_EQ, static_cast<scmp_datum_t>(family), 0});
  }
}

void AddMemory(Filter& filter) {
  filter.Add(kEnd, SCMP_SYS(mmap), Has(2, PROT_WRITE | PROT_EXEC));
  filter.Add(kEnd, SCMP_SYS(mprotect), Has(2, PROT_EXEC));
  filter.Add(kEnd, SCMP_SYS(pkey_mprotect), Has(2, PROT_EXEC));
  filter.Add(kEnd, SCMP_SYS(shmat), Has(2, SHM_EXEC));
}

void AddNamespaces(Filter& filter) {
  for (const std::uint64_t kind : {CLONE_NEWNS, CLONE_NEWCGROUP, CLONE_NEWUTS, CLONE_NEWIPC,
                                   CLONE_NEWUSER, CLONE_NEWPID, CLONE_NEWNET}) {
    filter.Add(kEnd, SCMP_SYS(clone), Has(0, kind));
  }
  filter.Add(kEnd, SCMP_SYS(unshare));
  filter.Add(kEnd, SCMP_SYS(setns));
  // A filter cannot see the flags of clone3. If clone3 does not exist, the C library uses clone.
  filter.Add(SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3));
}

void AddModes(Filter& filter) {
  for (const std::uint64_t bit : {S_ISUID, S_ISGID}) {
    filter.Add(kEnd, SCMP_SYS(chmod), Has(1, bit));
    filter.Add(kEnd, SCMP_SYS(fchmod), Has(1, bit));
    filter.Add(kEnd, SCMP_SYS(fchmodat), Has(2, bit));
    filter.Add(kEnd, SCMP_SYS(mkdir), Has(1, bit));
    filter.Add(kEnd, SCMP_SYS(mkdirat), Has(2, bit));
  }
}

void Apply(const Directives& directives) {
  std::set<std::string> calls = AllowedCalls(directives.at("SystemCallFilter"));
  // As root, SQLite changes the owner of its files. The service is not root, but a test can be.
  if (::geteuid() == 0) calls.insert("fchown");
  ::umask(static_cast<mode_t>(std::stoi(directives.at("UMask").back().at(0), nullptr, 8)));
  if (IsOn(directives, "NoNewPrivileges")) ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);

  Filter some(SCMP_ACT_ALLOW);
  AddFamilies(directives.at("RestrictAddressFamilies"), some);
  if (IsOn(directives, "MemoryDenyWriteExecute")) AddMemory(some);
  if (IsOn(directives, "RestrictNamespaces")) AddNamespaces(some);
  if (IsOn(directives, "RestrictSUIDSGID")) AddModes(some);
  if (IsOn(directives, "LockPersonality")) some.Add(kEnd, SCMP_SYS(personality));
  if (IsOn(directives, "RestrictRealtime")) some.Add(kEnd, SCMP_SYS(sched_setscheduler));
  Filter all(kEnd);
  // The gateway asks for the clock's state and accepts a refusal
  // (gateway/daemon/clocks/clock_corrector.h).
  if (!calls.contains("clock_adjtime")) {
    all.Add(SCMP_ACT_ERRNO(EPERM), SCMP_SYS(clock_adjtime));
    all.Add(SCMP_ACT_ERRNO(EPERM), SCMP_SYS(adjtimex));
  }
  for (const std::string& name : calls) {
    const int call = ::seccomp_syscall_resolve_name(name.c_str());
    // Some system calls in the list exist on other processors only, or are newer than the library.
    if (call >= 0) all.Add(SCMP_ACT_ALLOW, call);
  }
  some.Load();
  all.Load();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) Give("usage: sandboxed UNIT PROGRAM [ARGUMENT…]");
  const Directives directives = ReadUnit(argv[1]);
  Apply(directives);
  ::execv(argv[2], argv + 2);
  Give(std::string(argv[2]) + ": " + std::strerror(errno));
}
