// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/process/serve.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <thread>

#include "gateway/base/time.h"

namespace baudgate::dds {
namespace {

constexpr Duration kLook = 100ms;  // how late a change of the number of subscribers may be told
constexpr int kMostPacketsAtOnce = 256;

/// What does not fit into the socket now stays in `held`. False: the daemon is gone.
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
      // A daemon that does not read this second reads the next counts.
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
