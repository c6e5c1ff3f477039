// SPDX-License-Identifier: Apache-2.0
#include "tests/system/pty_bus.h"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <utility>

#include "tests/system/child.h"
#include "transports/serial_settings.h"

namespace baudgate::system_test {
namespace {

constexpr int kEndOfRequest = 5;  // in ms of silence
constexpr Duration kThink = 5ms;
constexpr Duration kTalkEvery = 200ms;

constexpr config::SerialSettings kFormats[] = {{},
                                               {.data_bits = 7, .parity = config::Parity::even},
                                               {.parity = config::Parity::even},
                                               {.data_bits = 7, .parity = config::Parity::odd},
                                               {.parity = config::Parity::odd}};

bool IsOddParity(int fd) {
  termios mode{};
  return ::tcgetattr(fd, &mode) == 0 && (mode.c_cflag & PARODD) != 0;
}

}  // namespace

PtyBus::PtyBus(const std::string& link) : pty_(std::move(tools::Pty::Create(link).value())) {}

PtyBus::~PtyBus() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void PtyBus::Start() {
  thread_ = std::thread([this] { Run(); });
}

void PtyBus::Run() {
  Bytes request;
  Instant talked{};
  while (!stop_) {
    pollfd waited{pty_.master(), POLLIN, 0};
    const bool more = ::poll(&waited, 1, request.empty() ? kPollMilliseconds : kEndOfRequest) == 1;
    if (more) {
      std::uint8_t buffer[512];
      const ssize_t size = ::read(pty_.master(), buffer, sizeof buffer);
      if (size > 0) Append(request, View(buffer, static_cast<std::size_t>(size)));
    } else if (!request.empty()) {
      Answer(std::exchange(request, {}));
    }
    const Instant now = std::chrono::steady_clock::now();
    if (talk_.empty() || now - talked < kTalkEvery) continue;
    talked = now;
    (void)!::write(pty_.master(), talk_.data(), talk_.size());
  }
}

void PtyBus::Answer(const Bytes& request) {
  const auto port = transports::ReadSerialSettings(pty_.master());
  // A pty stores odd parity, but not whether parity is on.
  const bool odd = IsOddParity(pty_.master());
  Bytes replies;
  for (config::SerialSettings format : kFormats) {
    if ((format.parity == config::Parity::odd) != odd) continue;
    format.baud = port ? port->baud : 9600;
    Append(replies, View(bus_.Ask(request, format, std::chrono::steady_clock::now()).heard.bytes));
  }
  std::this_thread::sleep_for(kThink);
  (void)!::write(pty_.master(), replies.data(), replies.size());
}

}  // namespace baudgate::system_test
