// A port as the wire of a scan: bytes go to and come from a transport, in the time of this machine.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <memory>
#include <string>

#include "config/model/line.h"
#include "gateway/tools/scan/scanner.h"
#include "gateway/tools/terminal/stop_signals.h"
#include "transports/transport.h"

namespace baudgate {

class PortWire final : public scan::Wire, private TransportListener {
 public:
  /// The error says why the port cannot be opened. `stop` outlives the wire.
  static Result<std::unique_ptr<PortWire>> Open(const std::string& port,
                                                const config::SerialSettings& serial,
                                                const StopSignals& stop);
  ~PortWire() override;

  Status Apply(const config::SerialSettings& serial) override;
  Result<scan::Gathered> Listen(Duration time) override;
  Result<scan::Gathered> Ask(View request, Duration patience, Duration gap) override;
  Instant Now() override { return ReadClocks().instant; }

 private:
  PortWire(const std::string& port, const config::SerialSettings& serial, const StopSignals& stop);

  void OnOpened() override { opened_ = true; }
  void OnOpenFailed(const std::string& reason) override { lost_ = reason; }
  void OnBytes(View bytes) override;
  void OnLost(const std::string& reason) override { lost_ = reason; }

  bool is_broken() const { return stopped_ || !lost_.empty(); }
  void RunUntil(Instant until);
  void AwaitQuiet();
  bool IsOnlyRequest(View request) const;
  Result<scan::Gathered> Taken(Bytes early, std::uint32_t damaged_before);
  std::uint32_t Damaged() const;

  asio::io_context io_{1};
  asio::posix::stream_descriptor stop_;
  config::Line line_;
  std::unique_ptr<Transport> transport_;
  Bytes heard_;
  Instant last_byte_{};
  const bool rs485_;  ///< the driver switches the direction
  bool opened_ = false;
  bool stopped_ = false;
  std::string lost_;
};

}  // namespace baudgate
