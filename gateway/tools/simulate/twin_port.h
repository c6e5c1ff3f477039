// `TwinPort` is one connection to the simulated devices of a bus: a pty or a TCP connection. It
// divides received bytes into requests, and sends each piece of a reply at the time at which a
// serial line would have transmitted its last character.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/tools/simulate/residents.h"
#include "protocols/assembler.h"

namespace baudgate::tools {

// `ReceiveAs` computes which bytes a UART receives if characters were sent with other serial
// settings: it samples the bits of the wire at the receiver's bit rate, and reads them in the
// receiver's format. No I/O, no clock.
struct Received {
  Bytes bytes;              ///< a damaged character is 0, as a tty delivers it
  std::size_t damaged = 0;  ///< characters with a wrong parity or stop bit
};

/// Returns what a UART with the settings `receiver` receives when a UART with the settings `sender`
/// sends the characters `sent` without pauses. The wire is idle before and after them.
Received ReceiveAs(const config::SerialSettings& receiver, View sent,
                   const config::SerialSettings& sender);

/// True if characters between UARTs with these settings arrive unchanged.
bool Understand(const config::SerialSettings& a, const config::SerialSettings& b);

/// The simulated devices of one bus, grouped by protocol, and their counters.
struct TwinBus {
  TwinWire wire;
  bool strict = false;
  std::vector<std::unique_ptr<Residents>> residents{};
  /// See SimulatorOptions::observer.
  std::function<void(View request, View reply, View delivered)> observer{};
  std::atomic<std::uint64_t> answered = 0;
  std::atomic<std::uint64_t> characters = 0;
};

class TwinPort : public std::enable_shared_from_this<TwinPort> {
 public:
  /// Takes over the descriptor. Handlers hold only a weak reference, so they do nothing after this
  /// object is destroyed.
  TwinPort(asio::io_context& io, int descriptor, std::shared_ptr<TwinBus> bus);

  void Start();
  /// True if the other side has closed the connection, or Close was called.
  bool is_over() const { return over_; }
  void Close();

 private:
  void Read();
  void OnRequestBytes(View bytes);
  std::optional<Bytes> NextRequest(protocols::Assembler& assembler);
  std::size_t Held() const;
  void AwaitSilence();
  void OnSilence();
  void OnRequest(Residents& residents, View frame);
  Bytes AsSent(Residents& residents, View bytes) const;
  Bytes AsReceived(View bytes, const config::SerialSettings& speaker) const;
  Bytes Queue(Instant until, View bytes, const config::SerialSettings& speaker);
  void SendNext();
  void Speak();

  const std::shared_ptr<TwinBus> bus_;
  const int fd_;  // the descriptor of descriptor_, for reading the settings of a pty
  asio::posix::stream_descriptor descriptor_;
  asio::steady_timer timer_;
  asio::steady_timer silence_;  // runs while an assembler contains a part of a request
  asio::steady_timer
      speech_;  // expires when simulated devices are asked for unasked messages again
  std::vector<protocols::Assembler> assemblers_;  // one for each of bus_->residents
  std::array<std::uint8_t, 1024> buffer_{};
  bool over_ = false;
  Instant request_began_{};
  Instant request_heard_{};
  std::multimap<Instant, Bytes> leaving_;  // key: when the last character of the piece is sent
  Instant said_until_{};
  std::uint64_t waits_ = 0;
};

}  // namespace baudgate::tools
