// baudgate-dds: the process that speaks DDS for a gateway. Started by the daemon with its end of
// the link as a descriptor, or by systemd with the path of the daemon's socket.
// SPDX-License-Identifier: Apache-2.0
#include <malloc.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "gateway/base/version.h"
#include "gateway/dds/fast/fast_writer.h"
#include "gateway/dds/process/confine.h"
#include "gateway/dds/process/serve.h"

namespace {

using namespace baudgate;
using namespace baudgate::dds;

constexpr int kDone = 0;
constexpr int kFailed = 4;
constexpr int kUsage = 2;
constexpr int kMostArenas = 2;  // of 64 MiB address space each: one a thread would use up the limit
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

/// Readable when SIGTERM or SIGINT came. Made before any other thread, which inherits the mask.
Descriptor StopSignals() {
  sigset_t stop;
  sigemptyset(&stop);
  sigaddset(&stop, SIGTERM);
  sigaddset(&stop, SIGINT);
  sigprocmask(SIG_BLOCK, &stop, nullptr);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGHUP, SIG_IGN);
  return Descriptor(::signalfd(-1, &stop, SFD_CLOEXEC | SFD_NONBLOCK));
}

Result<ServeEnd> ServeOne(const Descriptor& link, const Descriptor& stop) {
  LinkServer server([](const LinkOpen& open) {
    return CreateFastWriter(open.participant, open.points, open.devices);
  });
  return Serve(link, server, stop.get(), [] { sd_notify(0, "WATCHDOG=1"); });
}

/// As a child of the daemon: one link, and what is wrong ends the process.
int ServeParent(const Options& options, const Descriptor& stop) {
  if (options.parent != 0 && !DieWith(options.parent)) return kDone;
  if (options.memory != 0) {
    if (const Status status = LimitMemory(options.memory); !status) Say(status.error());
  }
  if (const Status status = DenyCalls(); !status) {
    Say(status.error());
    return kFailed;
  }
  const auto end = ServeOne(Descriptor(options.link), stop);
  if (end) return kDone;
  Say(end.error());
  return kFailed;
}

/// As a service of its own: whoever listens at the socket, one after the other.
int ServeSocket(const Options& options, const Descriptor& stop) {
  sd_notify(0, "READY=1");
  bool told = false;
  for (;;) {
    auto link = ConnectTo(options.socket);
    if (link) {
      told = false;
      sd_notify(0, "STATUS=connected to the gateway");
      const auto end = ServeOne(*link, stop);
      if (!end) Say(end.error());
      if (end && *end == ServeEnd::stopped) return kDone;
    } else if (!told) {
      told = true;
      Say("waits for the gateway: " + link.error());
    }
    sd_notify(0, "STATUS=waits for the gateway\nWATCHDOG=1");
    pollfd waited{stop.get(), POLLIN, 0};
    if (::poll(&waited, 1, static_cast<int>(kConnectAgain / 1ms)) > 0) return kDone;
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("baudgate-dds: speaks DDS for baudgate, in a process of its own", "baudgate-dds");
  app.set_version_flag("--version", std::string("baudgate-dds ") + kVersion);
  Options options;
  auto* link = app.add_option("--link", options.link, "Descriptor of the link to the daemon");
  app.add_option("--parent", options.parent, "End with this process")->needs(link);
  app.add_option("--memory", options.memory, "Most address space in bytes")->needs(link);
  app.add_option("--socket", options.socket, "Path of the daemon's socket")->excludes(link);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (options.link < 0 && options.socket.empty()) {
    Say("the daemon starts this process; by hand only --socket PATH makes sense");
    return kUsage;
  }
  ::mallopt(M_ARENA_MAX, kMostArenas);
  const Descriptor stop = StopSignals();
  return options.socket.empty() ? ServeParent(options, stop) : ServeSocket(options, stop);
}
