// Bytes come from a tty: marks and software parity are taken out here, before the line sees them.
// SPDX-License-Identifier: Apache-2.0
#include "transports/serial_port.h"

#include <unistd.h>

#include <algorithm>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/post.hpp>

#include "transports/closer.h"
#include "transports/parity.h"
#include "transports/parmrk.h"
#include "transports/port_lock.h"
#include "transports/serial_settings.h"
#include "transports/stream_pump.h"
#include "transports/tty_mode.h"

namespace baudgate {
namespace {

using Descriptor = asio::posix::stream_descriptor;

/// So many requests in a row that were given up before they were out, and the user should hear of
/// it: as each is thrown away, neither kStall nor kMostUnsent ever comes about.
constexpr int kMostStuck = 5;

class SerialPort final : public Transport {
 public:
  SerialPort(std::string port, const config::SerialSettings& serial, asio::io_context& io,
             TransportListener& listener)
      : port_(std::move(port)), own_(serial), serial_(serial), io_(io), listener_(listener) {}
  ~SerialPort() override { Close(); }

  void Open() override;
  void Close() override;
  bool is_open() const override { return session_ != nullptr; }
  void Send(View bytes) override;
  void DropUnsent() override;
  Status Apply(const config::SerialSettings& serial) override;
  Status Reset(const config::SerialSettings& serial) override;
  std::optional<std::string> Restore() override;
  PortCounters Counters() const override;
  void Pause(bool paused) override {
    if (session_) session_->Pause(paused);
  }
  std::size_t Unsent() const override { return session_ ? session_->unsent() : 0; }
  bool IsDrained() const override;
  Status PassOn() override;
  void Purge(bool input, bool output) override;
  std::optional<ModemLines> ReadModemLines() const override;
  Status Set(PortSwitch which, bool on) override;
  bool KeepsBitRate() const override { return session_ && keeps_bit_rate_; }
  std::string Describe() const override { return "serial " + port_ + " " + serial_.ToString(); }

 private:
  void TryOpen();
  Result<Descriptor> Prepare();
  void OnRead(View raw);
  void OnEnd(const std::error_code& error);
  std::string StuckText() const;
  static void CloseDescriptor(int fd);

  const std::string port_;
  const config::SerialSettings own_;  ///< at each Open
  config::SerialSettings serial_;
  asio::io_context& io_;
  TransportListener& listener_;
  std::shared_ptr<StreamPump<Descriptor>> session_;
  std::shared_ptr<char> attempt_;  ///< held while an Open is under way; gone = cancelled
  bool keeps_bit_rate_ = false;
  int stuck_ = 0;                ///< requests in a row that were given up before they were out
  bool passed_on_ = false;       ///< to a client
  Instant out_at_{};             ///< by then the UART has sent all that its driver gave it
  bool settings_known_ = false;  ///< the port is set to serial_, not to the rest of a failed Apply
  std::optional<TtyMode> mode_;  ///< as the driver has taken these settings
  ParmrkDecoder marks_;
  SoftwareParity parity_;
  std::uint32_t earlier_parity_errors_ = 0;  ///< before the last Apply
  std::optional<PortCounters> at_open_;      ///< nothing = the driver does not count
};

void SerialPort::Open() {
  Close();
  serial_ = own_;
  attempt_ = std::make_shared<char>();
  asio::post(io_, [this, attempt = std::weak_ptr(attempt_)] {
    if (!attempt.expired()) TryOpen();
  });
}

void SerialPort::TryOpen() {
  attempt_.reset();
  auto descriptor = Prepare();
  if (!descriptor) {
    listener_.OnOpenFailed(descriptor.error());
    return;
  }
  session_ = std::make_shared<StreamPump<Descriptor>>(
      std::move(*descriptor), [this](View raw) { OnRead(raw); },
      [this](const std::error_code& error) { OnEnd(error); }, [this] { listener_.OnRoom(); });
  session_->Start();
  listener_.OnOpened();
}

Result<Descriptor> SerialPort::Prepare() {
  if (const Status possible = CheckSoftwareParity(serial_); !possible) {
    return Error{possible.error()};
  }
  const auto fd = OpenExclusive(port_);
  if (!fd) return Error{fd.error()};
  if (const Status set = ApplySerialSettings(*fd, OnTheWire(serial_), port_); !set) {
    CloseDescriptor(*fd);
    return Error{set.error()};
  }
  Descriptor descriptor(io_);
  std::error_code error;
  descriptor.assign(*fd, error);
  if (error) {
    CloseDescriptor(*fd);
    return Error{"cannot watch " + port_ + ": " + error.message()};
  }
  ResetSwitches(*fd, serial_);
  FlushInput(*fd);
  keeps_bit_rate_ = !IsPty(*fd);
  settings_known_ = true;
  passed_on_ = false;
  mode_ = TtyMode::Read(*fd);
  stuck_ = 0;
  out_at_ = {};
  marks_ = ParmrkDecoder();
  parity_ = SoftwareParity(serial_.software_parity ? serial_.parity : config::Parity::none);
  earlier_parity_errors_ = 0;
  at_open_ = ReadDriverCounters(*fd);
  return descriptor;
}

void SerialPort::Close() {
  attempt_.reset();
  if (!session_) return;
  session_->Stop();
  CloseDescriptor(session_->stream().release());
  session_.reset();
}

void SerialPort::CloseDescriptor(int fd) {
  // The kernel would wait for output that a stopped flow control never lets go.
  FlushAll(fd);
  ReleaseLocks(fd);
  if (IsPty(fd)) {
    close(fd);
  } else {
    CloseElsewhere(fd);
  }
}

void SerialPort::Send(View bytes) {
  if (!session_) return;
  out_at_ = std::max(out_at_, std::chrono::steady_clock::now()) +
            static_cast<std::int64_t>(bytes.size()) * serial_.CharacterTime();
  session_->Send(serial_.software_parity ? View(parity_.Encode(bytes)) : bytes);
}

void SerialPort::DropUnsent() {
  if (!session_) return;
  const int fd = session_->stream().native_handle();
  const bool held_here = session_->DropUnsent();
  stuck_ = held_here || UnsentOutput(fd) > 0 ? stuck_ + 1 : 0;
  // Even if nothing seems to be left: a pty does not tell.
  FlushOutput(fd);
  // What a driver does not let go can only be got rid of by closing the port.
  if (UnsentOutput(fd) > 0 || stuck_ >= kMostStuck) session_->EndSoon(asio::error::timed_out);
}

Status SerialPort::Apply(const config::SerialSettings& serial) {
  if (const Status possible = CheckSoftwareParity(serial); !possible) return possible;
  if (session_) {
    if (settings_known_ && SameSettings(serial, serial_)) return {};
    settings_known_ = false;
    const int fd = session_->stream().native_handle();
    const auto damage = passed_on_ ? Damage::as_it_is : Damage::marked;
    if (const Status set = ApplySerialSettings(fd, OnTheWire(serial), port_, damage); !set) {
      return set;
    }
    settings_known_ = true;
    mode_ = TtyMode::Read(fd);
    earlier_parity_errors_ += parity_.errors();
    parity_ = SoftwareParity(serial.software_parity ? serial.parity : config::Parity::none);
  }
  serial_ = serial;
  return {};
}

/// A pty does not tell what the other side has not read yet, and a flush would take that away.
Status SerialPort::Reset(const config::SerialSettings& serial) {
  if (!session_) return {};
  if (IsPty(session_->stream().native_handle())) {
    session_->DropUnsent();
    Purge(true, false);
  } else {
    Purge(true, !IsDrained());
  }
  passed_on_ = false;
  marks_ = ParmrkDecoder();
  settings_known_ = false;
  if (const Status set = Apply(serial); !set) return set;
  ResetSwitches(session_->stream().native_handle(), serial);
  session_->SetPatient(false);
  session_->Pause(false);
  return {};
}

std::optional<std::string> SerialPort::Restore() {
  if (!session_ || !settings_known_ || !mode_) return std::nullopt;
  const int fd = session_->stream().native_handle();
  LetOutputGo(fd);
  const auto now = TtyMode::Read(fd);
  if (!now || *now == *mode_) return std::nullopt;
  // What cannot be set again is seen, and said, the next time.
  const auto damage = passed_on_ ? Damage::as_it_is : Damage::marked;
  if (ApplySerialSettings(fd, OnTheWire(serial_), port_, damage)) FlushInput(fd);
  return mode_->ChangesTo(*now);
}

Status SerialPort::PassOn() {
  if (!session_) return {};
  session_->SetPatient(true);
  passed_on_ = true;
  settings_known_ = false;
  return Apply(serial_);
}

/// A driver counts neither the characters in its UART nor, of most USB adapters, those in the
/// adapter: they need their time on the wire.
bool SerialPort::IsDrained() const {
  if (!session_) return true;
  if (session_->unsent() > 0 || UnsentOutput(session_->stream().native_handle()) > 0) return false;
  return !keeps_bit_rate_ || std::chrono::steady_clock::now() >= out_at_;
}

void SerialPort::Purge(bool input, bool output) {
  if (!session_) return;
  const int fd = session_->stream().native_handle();
  if (input) FlushInput(fd);
  if (!output) return;
  session_->DropUnsent();
  FlushOutput(fd);
  out_at_ = {};
}

std::optional<ModemLines> SerialPort::ReadModemLines() const {
  return session_ ? baudgate::ReadModemLines(session_->stream().native_handle()) : std::nullopt;
}

Status SerialPort::Set(PortSwitch which, bool on) {
  if (!session_) return Error{port_ + " is not open"};
  return SetSwitch(session_->stream().native_handle(), which, on, port_);
}

void SerialPort::OnRead(View raw) {
  stuck_ = 0;
  if (passed_on_ && !serial_.software_parity) return listener_.OnBytes(raw);
  Bytes characters = passed_on_ ? Bytes(raw.begin(), raw.end()) : marks_.Decode(raw);
  if (serial_.software_parity) characters = parity_.Decode(characters);
  if (!characters.empty()) listener_.OnBytes(characters);
}

void SerialPort::OnEnd(const std::error_code& error) {
  const bool full = error == asio::error::timed_out || error == asio::error::no_buffer_space;
  Close();
  if (full) return listener_.OnStuck(StuckText());
  // Linux reports a vanished adapter as end of file, EIO or ENODEV, depending on the driver.
  listener_.OnLost(port_ + " is gone (" + error.message() + "); was the adapter unplugged?");
}

std::string SerialPort::StuckText() const {
  return port_ + " takes no data" +
         (serial_.rtscts    ? "; is the CTS line of the device connected and active?"
          : serial_.xonxoff ? "; XOFF came, and no XON since: switch XON/XOFF off at both ends"
                            : "");
}

PortCounters SerialPort::Counters() const {
  PortCounters counters;
  const auto now =
      session_ && at_open_ ? ReadDriverCounters(session_->stream().native_handle()) : std::nullopt;
  if (now) {
    // Unsigned differences stay right when the driver's totals wrap.
    counters.parity = now->parity - at_open_->parity;
    counters.framing = now->framing - at_open_->framing;
    counters.overrun = now->overrun - at_open_->overrun;
    counters.breaks = now->breaks - at_open_->breaks;
  } else if (OnTheWire(serial_).parity != config::Parity::none) {
    counters.parity = marks_.damaged();
  } else {
    counters.framing = marks_.damaged();
  }
  counters.parity += earlier_parity_errors_ + parity_.errors();
  return counters;
}

}  // namespace

std::unique_ptr<Transport> MakeSerialPort(std::string port, const config::SerialSettings& serial,
                                          asio::io_context& io, TransportListener& listener) {
  return std::make_unique<SerialPort>(std::move(port), serial, io, listener);
}

}  // namespace baudgate
