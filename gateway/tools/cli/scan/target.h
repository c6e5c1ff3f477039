// The target of `baudgate scan` and `baudgate ask`: a port, or a line of the running gateway.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <memory>
#include <ostream>
#include <string>

#include "config/model/line.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/tools/scan/scanner.h"
#include "gateway/tools/terminal/command_end.h"
#include "transports/transport.h"

namespace baudgate::tools {

/// True for a path with '/' or tcp://. All other targets are lines: the name of a line contains no
/// '/'.
bool IsPort(const std::string& target);

/// Fails if the target is neither a port nor a line. The error contains the correct form of a port.
Status CheckTarget(const std::string& target);

// `LineLoan` is a line of a running gateway whose port is lent to this program. The gateway takes
// the port back when the loan ends, or two minutes after the last renewal if this program has died.
class LineLoan {
 public:
  /// Borrows the port of a line. Null: this has failed, `code` is the exit code, and the reason was
  /// printed on `err`. `socket`: see ControlClient::Connect.
  static std::unique_ptr<LineLoan> Take(const std::string& line, const std::string& socket,
                                        std::ostream& err, int& code);
  ~LineLoan();
  LineLoan(const LineLoan&) = delete;
  LineLoan& operator=(const LineLoan&) = delete;

  const std::string& port() const { return port_; }
  /// Extends the loan. Must be called repeatedly, because a loan ends after two minutes.
  void Renew(Instant now);

 private:
  LineLoan(std::string line, std::string socket, std::string port)
      : line_(std::move(line)), socket_(std::move(socket)), port_(std::move(port)) {}

  const std::string line_;
  const std::string socket_;
  const std::string port_;
  Instant renewed_{};
};

// `PortWire` is the wire of a scan over a real port: it sends and receives through a transport.
class PortWire final : public scan::Wire, private transports::TransportListener {
 public:
  /// `stop` must outlive the wire.
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
  std::unique_ptr<transports::Transport> transport_;
  Bytes heard_;
  Instant last_byte_{};
  const bool rs485_;
  bool opened_ = false;
  bool stopped_ = false;
  std::string lost_;
};

}  // namespace baudgate::tools
