// One way to the twins of a bus: a pty, or a connection. Bytes become requests, and what the twins
// say goes out when its last character would have come over the wire. ReceiveAs gives what a UART
// makes of characters with other settings.
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

// What a UART makes of characters that another one has sent with other settings: the bits of the
// wire, sampled at the receiver's own rate and read in its own format. Pure.
struct Received {
  Bytes bytes;              ///< a damaged character is 0, as a tty hands it over
  std::size_t damaged = 0;  ///< characters with a wrong parity or stop bit
};

/// `sent`: characters without a pause between them, on a wire that is idle before and after.
Received ReceiveAs(const config::SerialSettings& receiver, View sent,
                   const config::SerialSettings& sender);

/// Whether every character arrives as it was sent.
bool Understand(const config::SerialSettings& a, const config::SerialSettings& b);

/// The twins of one bus, of one protocol after the other, and what is counted of them.
struct TwinBus {
  TwinWire wire;
  /// A reader that has set its pty to other settings than the twin's gets what a UART makes of it.
  bool strict = false;
  std::vector<std::unique_ptr<Residents>> residents{};
  /// See SimulatorOptions.
  std::function<void(View request, View reply, View delivered)> observer{};
  std::atomic<std::uint64_t> answered = 0;
  std::atomic<std::uint64_t> characters = 0;
};

class TwinPort : public std::enable_shared_from_this<TwinPort> {
 public:
  /// Takes over the descriptor. Handlers that are due already run after the port is gone: they hold
  /// it weakly.
  TwinPort(asio::io_context& io, int descriptor, std::shared_ptr<TwinBus> bus);

  void Start();
  /// The other side has gone.
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
  const int fd_;  // the descriptor's, which is asked for the settings of a pty
  asio::posix::stream_descriptor descriptor_;
  asio::steady_timer timer_;
  asio::steady_timer silence_;                    // while part of a request is held
  asio::steady_timer speech_;                     // of twins that speak unasked
  std::vector<protocols::Assembler> assemblers_;  // of each of the bus's residents
  std::array<std::uint8_t, 1024> buffer_{};
  bool over_ = false;
  Instant request_began_{};
  Instant request_heard_{};                // its last bytes
  std::multimap<Instant, Bytes> leaving_;  // by when the last character of each piece is through
  Instant said_until_{};                   // of the pieces that have left
  std::uint64_t waits_ = 0;
};

}  // namespace baudgate::tools
