// `SerialPort` reads and writes a tty. It decodes PARMRK marks and software parity before it passes
// the bytes to the listener.
// SPDX-License-Identifier: Apache-2.0
#include "transports/serial_port.h"

#include <fcntl.h>
#include <grp.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/post.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <deque>
#include <fstream>
#include <vector>

#include "gateway/base/system_trouble.h"
#include "gateway/base/text.h"
#include "gateway/base/worker.h"
#include "transports/parity.h"
#include "transports/serial_settings.h"
#include "transports/stream_pump.h"

namespace baudgate::transports {

namespace {

std::string GroupOf(gid_t id) {
  group entry{};
  group* found = nullptr;
  std::vector<char> names(4096);
  if (getgrgid_r(id, &entry, names.data(), names.size(), &found) != 0 || found == nullptr) {
    return std::to_string(id);
  }
  return entry.gr_name;
}

std::string NotSerial(const std::string& port) {
  return port + " is not a serial port; correct port";
}

/// Returns an error text if something exists at `port` that is not a device; else an empty text.
std::string OtherThing(const std::string& port) {
  struct stat info {};
  if (stat(port.c_str(), &info) != 0) return {};
  if (S_ISDIR(info.st_mode)) return port + " is a folder, not a serial port; correct port";
  if (S_ISREG(info.st_mode)) {
    return port +
           " is an ordinary file, not a serial port; remove this file, which was perhaps written "
           "while the adapter was away, or correct port";
  }
  return S_ISCHR(info.st_mode) ? std::string() : NotSerial(port);
}

std::string NoSerialPort(const std::string& port) {
  const std::string other = OtherThing(port);
  return other.empty() ? NotSerial(port) : other;
}

std::string HowToAllow(const std::string& port) {
  struct stat info {};
  const bool known = stat(port.c_str(), &info) == 0;
  if (known && !IsGroupForPorts(info.st_gid, info.st_mode)) return "run: " + HowToGive(port);
  const std::string group = known ? GroupOf(info.st_gid) : "dialout";
  return "add the user of the gateway to group " + group;
}

/// Returns the process that has a flock on the same inode; nothing if there is none, or if it is in
/// another pid namespace. Reads /proc/locks: "1: FLOCK  ADVISORY  WRITE 1234 00:05:87 0 EOF".
std::optional<pid_t> LockHolder(int fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0) return std::nullopt;
  char inode[64];
  std::snprintf(inode, sizeof inode, "%02x:%02x:%llu", major(info.st_dev), minor(info.st_dev),
                static_cast<unsigned long long>(info.st_ino));
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::vector<std::string_view> words;
    for (const std::string_view word : Split(line, ' ')) {
      if (!word.empty()) words.push_back(word);
    }
    if (words.size() < 6 || words[1] != "FLOCK" || words[5] != inode) continue;
    const auto holder = ParseInteger<pid_t>(words[4]);
    if (holder && *holder > 0) return holder;
  }
  return std::nullopt;
}

std::string Conflict(const std::string& port, std::optional<pid_t> holder) {
  if (!holder) {
    return port + " is in use by another program (" + NameHolders(port) +
           "); close the port in that program first";
  }
  if (*holder == getpid())
    return port + " is in use by another line of this gateway; give each line its own port";
  std::ifstream file("/proc/" + std::to_string(*holder) + "/comm");
  std::string name;
  std::getline(file, name);
  if (name.empty()) name = "another program";
  return port + " is in use by " + name + " (pid " + std::to_string(*holder) +
         "); close the port in that program first";
}

Status Lock(int fd, const std::string& port) {
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return Error{Conflict(port, LockHolder(fd))};
    return Error{"cannot lock " + port + ": " + std::strerror(errno)};
  }
  // TIOCEXCL of a pty would stay set after this close(), as long as the other side is open.
  if (IsPty(fd)) return {};
  int exclusive = 0;
  // Root can open a port that another program holds exclusively, but must not disturb that program.
  if (ioctl(fd, TIOCGEXCL, &exclusive) == 0 && exclusive != 0) {
    return Error{Conflict(port, std::nullopt)};
  }
  if (ioctl(fd, TIOCEXCL) != 0) {
    return Error{"cannot lock " + port + " for exclusive use: " + std::strerror(errno)};
  }
  return {};
}

}  // namespace

bool IsGroupForPorts(gid_t group, mode_t mode) { return group != 0 && (mode & 0060U) == 0060U; }

std::string HowToGive(const std::string& port) {
  return "sudo chgrp dialout " + port + " && sudo chmod 660 " + port +
         "; to keep this after a restart, add a udev rule";
}

std::string OpenErrorText(const std::string& port, int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return "no such port " + port + "; plug the adapter in, or correct port";
    case EACCES:
    case EPERM:
      if (auto other = OtherThing(port); !other.empty()) return other;
      return "no permission for " + port + "; " + HowToAllow(port);
    case EBUSY:
      return Conflict(port, std::nullopt);
    case EISDIR:
    case ENOTDIR:
      return NoSerialPort(port);
    case EIO:
      return port +
             " exists but does not work (input/output error); check whether there is hardware "
             "behind this port";
    default:
      return "cannot open " + port + ": " + std::strerror(error);
  }
}

Result<int> OpenExclusive(const std::string& port) {
  const int fd = open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return Error{OpenErrorText(port, errno)};
  if (isatty(fd) == 0) {
    const int error = errno;  // EIO: a port of the board without hardware behind it
    close(fd);
    return Error{error == EIO ? OpenErrorText(port, EIO) : NoSerialPort(port)};
  }
  if (const Status locked = Lock(fd, port); !locked) {
    close(fd);
    return Error{locked.error()};
  }
  return fd;
}

void ReleaseLocks(int fd) {
  if (!IsPty(fd)) (void)ioctl(fd, TIOCNXCL);
  (void)flock(fd, LOCK_UN);
}

// `Queue` contains the descriptors that wait for one of at most kMostClosers threads. A thread ends
// when the queue is empty.

namespace {

struct Queue {
  Mutex mutex;
  std::deque<int> waiting BAUDGATE_GUARDED_BY(mutex);
  int threads BAUDGATE_GUARDED_BY(mutex) = 0;
};

void Work(const std::shared_ptr<Queue>& queue) {
  for (;;) {
    int fd = -1;
    {
      const MutexLock lock(queue->mutex);
      if (queue->waiting.empty()) {
        --queue->threads;
        return;
      }
      fd = queue->waiting.front();
      queue->waiting.pop_front();
    }
    close(fd);
  }
}

}  // namespace

void CloseElsewhere(int fd) {
  // All lines of the process share the queue. The threads own it as well, because they can outlive
  // main().
  static const std::shared_ptr<Queue> queue = std::make_shared<Queue>();
  const MutexLock lock(queue->mutex);
  queue->waiting.push_back(fd);
  if (queue->threads >= kMostClosers) return;
  if (StartDetached("close port", [shared = queue] { Work(shared); })) {
    ++queue->threads;
  } else if (queue->threads == 0) {  // if a thread runs, it closes fd
    queue->waiting.pop_back();
    close(fd);
  }
}

namespace {

using Descriptor = asio::posix::stream_descriptor;

/// After this number of consecutive requests that were given up before they were sent, the port
/// counts as stuck. They are discarded, so StreamPump's kStall and kMostUnsent do not detect this.
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
  void OnStreamEnd(const std::error_code& error);
  std::string StuckText() const;
  static void CloseDescriptor(int fd);

  const std::string port_;
  const config::SerialSettings own_;  ///< the settings that each Open applies
  config::SerialSettings serial_;
  asio::io_context& io_;
  TransportListener& listener_;
  std::shared_ptr<StreamPump<Descriptor>> session_;
  std::shared_ptr<char> attempt_;  ///< null: no Open is pending, so a posted TryOpen has no effect
  bool keeps_bit_rate_ = false;
  int stuck_ = 0;                ///< consecutive requests that were given up before they were sent
  bool passed_on_ = false;       ///< the port is lent to a client
  Instant out_at_{};             ///< when the UART will have sent all bytes that were written
  bool settings_known_ = false;  ///< false: the port may have other settings than `serial_`
  std::optional<TtyMode> mode_;  ///< the settings of the tty, read back from the driver
  ParmrkDecoder marks_;
  SoftwareParity parity_;
  std::uint32_t earlier_parity_errors_ = 0;  ///< parity errors counted before the last Apply
  /// The driver's totals at Open. Nothing: the driver does not count.
  std::optional<PortCounters> at_open_;
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
      [this](const std::error_code& error) { OnStreamEnd(error); }, [this] { listener_.OnRoom(); });
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
  // Without the flush, the kernel would wait for output that a stopped flow control never releases.
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
  // The output is flushed even if nothing seems left, because a pty does not report unsent bytes.
  FlushOutput(fd);
  // Only closing the port removes output that the driver cannot discard. EndSoon closes the port.
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

/// Keeps the output of a pty: a flush would discard bytes that the other side has not read yet, and
/// a pty does not report their number.
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
  // If the settings cannot be set again, the next call detects and reports the change again.
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

/// The driver's count omits the characters in the UART and, with most USB adapters, those in the
/// adapter, so the port counts as drained only after their transmission time.
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
  return session_ ? transports::ReadModemLines(session_->stream().native_handle()) : std::nullopt;
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

void SerialPort::OnStreamEnd(const std::error_code& error) {
  const bool full = error == asio::error::timed_out || error == asio::error::no_buffer_space;
  Close();
  if (full) return listener_.OnStuck(StuckText());
  // Linux reports a removed adapter as end of file, EIO or ENODEV, depending on the driver.
  listener_.OnLost(port_ + " is gone (" + error.message() + "); plug the adapter in again");
}

std::string SerialPort::StuckText() const {
  return port_ + " takes no data" +
         (serial_.rtscts    ? "; check that the CTS line of the device is connected and active"
          : serial_.xonxoff ? " since it received XOFF and no XON; switch XON/XOFF off at both ends"
                            : "");
}

PortCounters SerialPort::Counters() const {
  PortCounters counters;
  const auto now =
      session_ && at_open_ ? ReadDriverCounters(session_->stream().native_handle()) : std::nullopt;
  if (now) {
    // Unsigned differences stay correct when the driver's totals wrap.
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

}  // namespace baudgate::transports
