// baudgate-dds is the process that handles DDS for a gateway. Either the daemon starts it with a
// descriptor of the link, or systemd starts it with the path of the daemon's socket.
// SPDX-License-Identifier: Apache-2.0
#include <malloc.h>
#include <poll.h>
#include <signal.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/exit_code.h"
#include "gateway/base/time.h"
#include "gateway/base/version.h"
#include "gateway/outputs/dds/fast/fast_writer.h"
#include "gateway/outputs/dds/fast/own_network.h"
#include "gateway/outputs/dds/link/process_link.h"
#include "gateway/outputs/dds/process/serve.h"
#include "gateway/outputs/dds/published_types.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/watch/restarting_child.h"
#include "gateway/tools/watch/watch.h"

namespace {

using namespace baudgate;
using namespace baudgate::dds;

constexpr std::uint64_t kMostWatchMemory = 2ULL << 30;
// A malloc arena takes 64 MiB of address space. One for each thread would exceed the memory limit.
constexpr int kMostArenas = 2;
constexpr auto kConnectAgain = 500ms;

struct Options {
  int link = -1;
  int parent = 0;
  std::uint64_t memory = 0;
  std::string socket;
};

void Say(const std::string& sentence) {
  std::fprintf(stderr, "baudgate-dds: %s\n", sentence.c_str());
}

/// Feeds the watchdog of this process: SIGALRM ends the process unless Live is called again within
/// `most`. If the gateway is dead, no other program ends a process that hangs, and subscribers
/// would take its last samples for valid. The default is longer than the time after which a live
/// gateway ends the process.
void Live(Duration most = LinkKeeper::kGivenUp + 5s) { ::alarm(static_cast<unsigned>(most / 1s)); }

/// The destructor stops the watchdog of Live. The object must be declared first, and so destroyed
/// last, so that the watchdog covers the other destructors.
struct LivesNoMore {
  ~LivesNoMore() { Live(0s); }
};

/// Extends the watchdogs of Live and of systemd while the DDS library opens, because nothing feeds
/// them in this time. The destructor restores systemd's time; the next call of Live restores its
/// own time.
class SlowWhile {
 public:
  SlowWhile() : watched_(sd_watchdog_enabled(0, &usual_) > 0) {
    Live(LinkKeeper::kOpening + 5s);
    Allow(LinkKeeper::kOpening / 1us);
  }
  ~SlowWhile() { Allow(static_cast<std::int64_t>(usual_)); }
  SlowWhile(const SlowWhile&) = delete;
  SlowWhile& operator=(const SlowWhile&) = delete;

 private:
  void Allow(std::int64_t most) const {
    if (watched_) sd_notifyf(0, "WATCHDOG_USEC=%" PRId64 "\nWATCHDOG=1", most);
  }

  std::uint64_t usual_ = 0;  // systemd's time, in microseconds
  const bool watched_;
};

Result<ServeEnd> ServeOne(const Descriptor& link, const tools::StopSignals& stop) {
  const LivesNoMore last;
  const WakeUp wake;
  std::optional<InterfaceWatch> interfaces;
  ParticipantOptions options;
  PortWatch port;
  LinkServer server(
      [&](const LinkOpen& open) {
        const SlowWhile opening;
        options = open.participant;
        options.name = open.gateway;
        interfaces.emplace(options.interfaces, FindOwnAddresses());
        return CreateFastWriter(options, open.room, open.requests ? open.gateway : std::string());
      },
      [&wake] { wake.Ring(); });
  const auto alive = [&]() -> Status {
    Live();
    sd_notify(0, "WATCHDOG=1");
    if (!interfaces) return {};
    const OwnAddresses own = FindOwnAddresses();
    auto changed = interfaces->Look(own);
    if (!changed) changed = port.Look(options, own);
    if (changed) return Error{*changed + ": DDS restarts"};
    return {};
  };
  return Serve(link, server, wake, stop.descriptor(), alive);
}

/// Limits the memory and the system calls of this process. `memory`: limit of the address space in
/// bytes; 0: no limit.
Status Confine(std::uint64_t memory) {
  if (kSanitized) return {};
  if (memory != 0) {
    if (Status status = LimitMemory(memory); !status) return status;
  }
  return DenyCalls();
}

/// Serves the daemon that has started this process, over `link`. An error ends the process.
int ServeParent(const Options& options, const tools::StopSignals& stop) {
  if (options.parent != 0 && !EndWith(options.parent)) return kExitDone;
  if (const Status status = Confine(options.memory); !status) {
    Say(status.error());
    return kExitCanNot;
  }
  const auto end = ServeOne(Descriptor(options.link), stop);
  if (end) return kExitDone;
  Say(end.error());
  return kExitCanNot;
}

/// Serves one gateway after the other at the socket, as a service of systemd.
int ServeSocket(const Options& options, const tools::StopSignals& stop) {
  sd_notify(0, "READY=1");
  bool told = false;
  for (;;) {
    auto link = ConnectTo(options.socket);
    if (link) {
      told = false;
      sd_notify(0, "STATUS=connected to the gateway");
      const auto end = ServeOne(*link, stop);
      if (!end) Say(end.error());
      if (end && *end == ServeEnd::stopped) return kExitDone;
    } else if (!told) {
      told = true;
      Say("waits for the gateway: " + link.error());
    }
    sd_notify(0, "STATUS=waits for the gateway\nWATCHDOG=1");
    pollfd waited{stop.descriptor(), POLLIN, 0};
    if (::poll(&waited, 1, static_cast<int>(kConnectAgain / 1ms)) > 0) return kExitDone;
  }
}

/// Runs `baudgate watch` in a child process, so that a datagram that crashes the DDS library does
/// not end this process. The child returns an error code if its output cannot be written.
int Watch(tools::WatchOptions& options) {
  constexpr Duration kLadder[] = {100ms, 500ms, 1s, 2s, 5s, 10s};
  if (tools::LiveScreen::Possible(STDOUT_FILENO))
    options.terminal = tools::TerminalView(STDOUT_FILENO);
  const Instant begun = ReadClocks().instant;
  const auto run = [&options, begun] {
    if (options.seconds) {
      *options.seconds = std::max(Duration(1ms), *options.seconds - (ReadClocks().instant - begun));
    }
    if (const Status status = Confine(kMostWatchMemory); !status) {
      Say(status.error());
      return kExitCanNot;
    }
    return tools::AfterOutput(RunWatch(options, std::cout, std::cerr));
  };
  return tools::RunGuarded(run, kLadder, std::cerr);
}

}  // namespace

int main(int argc, char** argv) {
  // `baudgate watch` starts this program with argv[0] = "baudgate", so that messages contain this
  // name.
  const bool as_baudgate = argc > 0 && std::string_view(argv[0]) == "baudgate";
  CLI::App app("baudgate-dds: the process that speaks DDS for baudgate",
               as_baudgate ? "baudgate" : "baudgate-dds");
  app.set_version_flag("--version", std::string("baudgate-dds ") + kVersion);
  Options options;
  auto* link = app.add_option("--link", options.link, "Descriptor of the link to the gateway");
  app.add_option("--parent", options.parent, "End when this process ends")->needs(link);
  app.add_option("--memory", options.memory, "Limit of the address space of this process, in bytes")
      ->needs(link);
  app.add_option("--socket", options.socket, "Path of the gateway's socket")->excludes(link);
  bool types = false;
  app.add_flag("--types-xml", types, "Print the published types as DDS-XML");
  tools::WatchOptions watch;
  const auto* watches = AddWatch(app, watch);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? tools::AfterOutput(kExitDone) : kExitUsage;
  }
  if (types) {
    std::cout << TypesXml();
    return tools::AfterOutput(kExitDone);
  }
  ::mallopt(M_ARENA_MAX, kMostArenas);
  if (watches->parsed()) return Watch(watch);
  if (options.link < 0 && options.socket.empty()) {
    Say("the gateway starts this process; to start it by hand, add --socket PATH");
    return kExitUsage;
  }
  signal(SIGPIPE, SIG_IGN);
  signal(SIGHUP, SIG_IGN);
  // Must exist before any thread, which inherits the blocked signals.
  const tools::StopSignals stop;
  return options.socket.empty() ? ServeParent(options, stop) : ServeSocket(options, stop);
}
