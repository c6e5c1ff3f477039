// Tests of AskTimeService. The test simulates the time service at the other end of a socket.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <systemd/sd-bus.h>

#include <thread>

#include "gateway/daemon/clocks/clock_corrector.h"

namespace baudgate::daemon {
namespace {

struct Closes {
  void operator()(sd_bus* bus) const { sd_bus_flush_close_unref(bus); }
};
using SentBus = std::unique_ptr<sd_bus, Closes>;

SentBus Open(int descriptor, bool server) {
  sd_bus* made = nullptr;
  EXPECT_GE(sd_bus_new(&made), 0);
  SentBus bus(made);
  EXPECT_GE(sd_bus_set_fd(made, descriptor, descriptor), 0);
  sd_id128_t id{};
  sd_id128_randomize(&id);
  if (server) {
    EXPECT_GE(sd_bus_set_server(made, 1, id), 0);
  }
  return bus;
}

int Say(sd_bus*, const char*, const char*, const char*, sd_bus_message* reply, void* what,
        sd_bus_error*) {
  return sd_bus_message_append(reply, "b", *static_cast<const int*>(what));
}

std::optional<bool> Ask(std::optional<int> said) {
  int ends[2] = {-1, -1};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
  std::thread service([&] {
    const sd_bus_vtable table[] = {SD_BUS_VTABLE_START(0),
                                   SD_BUS_PROPERTY("NTPSynchronized", "b", Say, 0, 0),
                                   SD_BUS_VTABLE_END};
    const SentBus bus = Open(ends[0], true);
    if (said) {
      EXPECT_GE(sd_bus_add_object_vtable(bus.get(), nullptr, "/org/freedesktop/timedate1",
                                         "org.freedesktop.timedate1", table, &*said),
                0);
    }
    EXPECT_GE(sd_bus_start(bus.get()), 0);
    for (int done = 0; done >= 0;) {
      done = sd_bus_process(bus.get(), nullptr);
      if (done == 0) done = sd_bus_wait(bus.get(), UINT64_MAX);
    }
  });
  std::optional<bool> answer;
  {
    const SentBus bus = Open(ends[1], false);
    EXPECT_GE(sd_bus_start(bus.get()), 0);
    answer = AskTimeService(*bus);
  }
  service.join();
  return answer;
}

TEST(TimeService, ReportsWhetherTheClockIsSynchronised) {
  EXPECT_EQ(Ask(1), true);
  EXPECT_EQ(Ask(0), false);
}

TEST(TimeService, ReportsNothingWhenTheServiceIsMissing) {
  EXPECT_EQ(Ask(std::nullopt), std::nullopt);
}

}  // namespace
}  // namespace baudgate::daemon
