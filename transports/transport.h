// The contract of transports: bytes to and from one line's wire. A transport knows nothing of
// protocols. All calls and all callbacks happen on the thread of the line's io_context.
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

/// Why there is no connection to a server, as far as the network tells it.
enum class NoConnection : std::uint8_t {
  other,
  refused,      ///< its host is there, and nothing takes connections at that port
  unreachable,  ///< no host answers
};

/// The listener of a transport. No callback comes from within a call to the transport itself.
class TransportListener {
 public:
  virtual ~TransportListener() = default;
  virtual void OnOpened() = 0;
  /// Open did not succeed; the transport is closed again. `reason` is a sentence for the log that
  /// says what to do: "no such port /dev/ttyUSB7; is the adapter plugged in?".
  virtual void OnOpenFailed(const std::string& reason) = 0;
  /// The same for a server.
  virtual void OnNoConnection(const std::string& reason, NoConnection /*why*/) {
    OnOpenFailed(reason);
  }
  /// A character that came with a parity or framing error is 0xFF here: no protocol of ours takes
  /// it for anything, and dropping it would make a shorter number of an unchecked one.
  virtual void OnBytes(View bytes) = 0;
  /// All bytes of Send have been taken, after some had to wait.
  virtual void OnRoom() {}
  /// The port or connection is gone (unplugged, hung up); the transport has closed itself.
  virtual void OnLost(const std::string& reason) = 0;
  /// The port takes no data; the transport has closed itself.
  virtual void OnStuck(const std::string& reason) { OnLost(reason); }
  /// The other end has closed the connection. `unread`: without having read all that was sent. The
  /// transport has closed itself.
  virtual void OnEnded(const std::string& reason, bool /*unread*/) { OnLost(reason); }
};

/// Errors that the driver counts, since the port was opened; all zero where it does not.
struct PortCounters {
  std::uint32_t parity = 0;
  std::uint32_t framing = 0;
  std::uint32_t overrun = 0;
  std::uint32_t breaks = 0;  ///< of the framing errors
};

/// What a client of a port may switch.
enum class PortSwitch : std::uint8_t { dtr, rts, break_signal };

class Transport {
 public:
  virtual ~Transport() = default;
  /// Ends in exactly one OnOpened or OnOpenFailed, unless Close comes first. The port has the
  /// settings that it was made with, whatever Apply has set before; bytes that it held are dropped.
  virtual void Open() = 0;
  /// At once and without a callback; a driver that takes long to close does so elsewhere.
  virtual void Close() = 0;
  virtual bool is_open() const = 0;
  /// Hands the bytes over, all of them or OnLost. Only while open.
  virtual void Send(View bytes) = 0;
  /// What was given to Send and has not left this machine yet never will: its request has been
  /// given up. Where nothing else takes it back, the transport closes itself and OnLost follows.
  /// What the other side has taken over and still holds is out of reach.
  virtual void DropUnsent() = 0;
  /// Other settings on the open port, for buses that are switched per device. Takes effect at once,
  /// without waiting for output: between exchanges only.
  virtual Status Apply(const config::SerialSettings& serial) = 0;
  /// The open port is as after Open, whatever was set, switched, paused or sent meanwhile. What
  /// IsDrained has said is out goes its way.
  virtual Status Reset(const config::SerialSettings& serial) = 0;
  /// Where another program has changed the settings of the open port, they are set again; says
  /// what was changed: "echo is on, input comes by whole lines".
  virtual std::optional<std::string> Restore() { return std::nullopt; }
  virtual PortCounters Counters() const { return {}; }

  // For a port that is passed on to a client as it is (gateway/lines/serial_server).
  /// Nothing is read from the port any more; what it receives meanwhile waits in its driver.
  virtual void Pause(bool /*paused*/) {}
  /// So many bytes of Send wait here.
  virtual std::size_t Unsent() const { return 0; }
  /// All that was sent has left this machine, as far as one can tell.
  virtual bool IsDrained() const { return Unsent() == 0; }
  /// The port is a client's until Reset: flow control may hold output back for as long as it likes,
  /// and damaged characters come as they are.
  virtual Status PassOn() { return {}; }
  /// What is waiting in these directions is thrown away.
  virtual void Purge(bool /*input*/, bool /*output*/) {}
  /// Empty: the port has none, or its driver does not tell.
  virtual std::optional<ModemLines> ReadModemLines() const { return std::nullopt; }
  /// The error: the driver refuses it. A pty, which has no such lines, takes everything.
  virtual Status Set(PortSwitch /*which*/, bool /*on*/) {
    return Error{"a connection to a serial server has no such line"};
  }
  /// Characters take their time: a tty with a UART behind it, as far as one can tell.
  virtual bool KeepsBitRate() const { return false; }
  /// "serial /dev/ttyUSB0 9600 7E1", for logs.
  virtual std::string Describe() const = 0;
};

/// By the form of line.port (the io_context outlives the transport): "tcp://host:port" is a serial
/// server; everything else is a tty or pty.
std::unique_ptr<Transport> MakeTransport(const config::Line& line, asio::io_context& io,
                                         TransportListener& listener);

}  // namespace baudgate::transports
