// `Transport` is the interface to one line's wire: it sends and receives bytes and does not
// interpret them. All calls and callbacks happen on the thread of the line's io_context.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <memory>
#include <optional>
#include <string>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::transports {

enum class NoConnection : std::uint8_t {
  other,
  refused,      ///< the host answers, but no program accepts connections at that port
  unreachable,  ///< no host answers
};

/// The listener of a transport. No callback is made inside a call to the transport.
class TransportListener {
 public:
  virtual ~TransportListener() = default;
  virtual void OnOpened() = 0;
  /// Open failed; the transport is closed. `reason` is a sentence for the log with a remedy: "no
  /// such port /dev/ttyUSB7; plug the adapter in, or correct port".
  virtual void OnOpenFailed(const std::string& reason) = 0;
  /// Called instead of OnOpenFailed if the connection to a server failed.
  virtual void OnNoConnection(const std::string& reason, NoConnection /*why*/) {
    OnOpenFailed(reason);
  }
  /// Passes received bytes. A character with a parity or framing error arrives as 0xFF, see
  /// kDamaged in transports/parity.h.
  virtual void OnBytes(View bytes) = 0;
  /// Called when the system has accepted all bytes of Send, if some bytes had to wait.
  virtual void OnRoom() {}
  /// The port or connection is lost (unplugged, hung up); the transport has closed itself.
  virtual void OnLost(const std::string& reason) = 0;
  /// The port accepts no data for too long; the transport has closed itself.
  virtual void OnStuck(const std::string& reason) { OnLost(reason); }
  /// The peer has closed the connection, and the transport has closed itself. `unread`: the peer
  /// had not read all bytes that were sent.
  virtual void OnEnded(const std::string& reason, bool /*unread*/) { OnLost(reason); }
};

/// Error counts since the port was opened. If the driver does not count, `parity` or `framing`
/// counts the damaged characters.
struct PortCounters {
  std::uint32_t parity = 0;
  std::uint32_t framing = 0;
  std::uint32_t overrun = 0;
  std::uint32_t breaks = 0;  ///< included in `framing`
};

enum class PortSwitch : std::uint8_t { dtr, rts, break_signal };

class Transport {
 public:
  virtual ~Transport() = default;
  /// Opens the port with the settings of the constructor, even if Apply has set others, and drops
  /// old input. Exactly one OnOpened, OnOpenFailed or OnNoConnection follows, unless Close is
  /// called first.
  virtual void Open() = 0;
  /// Closes at once and without a callback. Another thread finishes the close of a slow driver.
  virtual void Close() = 0;
  virtual bool is_open() const = 0;
  /// Sends all bytes; if that fails, OnLost, OnStuck or OnEnded follows. Must be called only while
  /// the port is open.
  virtual void Send(View bytes) = 0;
  /// Discards bytes of Send that have not left this machine, because their request has been given
  /// up. If they cannot be withdrawn, the transport closes itself and OnStuck follows. Bytes that
  /// the other side has accepted cannot be withdrawn.
  virtual void DropUnsent() = 0;
  /// Changes the settings of the open port, for buses whose settings differ per device. The change
  /// takes effect at once, without waiting for output, so call it only between exchanges.
  virtual Status Apply(const config::SerialSettings& serial) = 0;
  /// Returns the open port to the state after Open, but with the settings `serial`. Undoes Set,
  /// Pause and PassOn. Bytes for which IsDrained was true are still transmitted.
  virtual Status Reset(const config::SerialSettings& serial) = 0;
  /// If another program has changed the settings of the open port, sets them again and returns what
  /// was changed: "echo is on, input is passed on only in whole lines". Else returns nothing.
  virtual std::optional<std::string> Restore() { return std::nullopt; }
  virtual PortCounters Counters() const { return {}; }

  // The functions from Pause to KeepsBitRate are for a port that is lent to a network client
  // (gateway/lines/serial_server).
  virtual void Pause(bool /*paused*/) {}
  /// Returns the number of bytes of Send that still wait in this program.
  virtual std::size_t Unsent() const { return 0; }
  /// True if all bytes have left this machine, as far as the system shows it.
  virtual bool IsDrained() const { return Unsent() == 0; }
  /// Lends the port to a client until Reset: flow control may hold output back without a time
  /// limit, and damaged characters arrive unmarked (with software parity, as 0xFF).
  virtual Status PassOn() { return {}; }
  /// Discards received bytes (`input`) and unsent bytes (`output`) that wait in this machine.
  virtual void Purge(bool /*input*/, bool /*output*/) {}
  /// Returns nothing if the port has no modem lines, or if its driver does not report them.
  virtual std::optional<ModemLines> ReadModemLines() const { return std::nullopt; }
  /// Switches a signal; fails if the driver refuses. A pty has no such signals and accepts every
  /// call.
  virtual Status Set(PortSwitch /*which*/, bool /*on*/) {
    return Error{"a connection to a serial server has no DTR, RTS or break"};
  }
  /// True if bytes take time to transmit: the port is a tty, no pty and no serial server.
  virtual bool KeepsBitRate() const { return false; }
  /// Returns "serial /dev/ttyUSB0 9600 7E1", for logs.
  virtual std::string Describe() const = 0;
};

/// Makes the transport for line.port: "tcp://host:port" is a serial server; every other text is a
/// tty or pty. `io` and `listener` must outlive the transport.
std::unique_ptr<Transport> MakeTransport(const config::Line& line, asio::io_context& io,
                                         TransportListener& listener);

}  // namespace baudgate::transports
