// `VirtualLine` is a whole line under virtual time: the poller, a wire with a bit rate, and the
// simulated devices of all devices, whose behaviour a test can disturb. Time jumps from event to
// event; no real clock is used. Works with the toy protocol and with the real protocols:
//
//   VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
//   line.Open();
//   line.twin(0).manner.dead = true;
//   line.RunFor(10s);
//   EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication);
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "tests/support/toy_protocol.h"

namespace baudgate::bus {
class Poller;
}  // namespace baudgate::bus

namespace baudgate {

/// How a device behaves on the wire, independent of the replies that the simulated device computes.
/// Can be changed at any time.
struct Manner {
  bool dead = false;
  Duration think = 5ms;      ///< time from the end of the request to the first byte of the reply
  std::size_t fragment = 0;  ///< bytes that arrive together; 0: the whole reply
  Duration pause{};          ///< additional silence between fragments
  int copies = 1;
  Duration babble{};
  std::function<Bytes(Bytes reply)> distort;
  /// Returns a reply in place of the simulated device's; nothing: the simulated device's reply is
  /// sent. Not called for requests that the simulated device does not answer, such as those to
  /// other devices.
  std::function<std::optional<Bytes>(View request)> instead;
  /// Returns what arrives and when, in place of the behaviour that the members above set; only
  /// `dead` and `fragment` still apply. Called for every request on the line; `reply` is empty if
  /// the simulated device does not answer. Example: gateway/tools/simulate/twin_faults.h.
  std::function<std::vector<tools::TimedPiece>(View request, Bytes reply, Instant end_of_request)>
      deliver;
};

struct Sent {
  Instant at;
  std::string text;
};

struct StateChange {
  Instant at;
  std::uint32_t device = 0;
  bus::DeviceState to = bus::DeviceState::never_seen;
};

inline void PrintTo(WriteEnd end, std::ostream* out) { *out << Name(end); }

class VirtualLine : private bus::RequestPort, private bus::PollerListener {
 public:
  struct WireTwin {
    std::unique_ptr<protocols::Twin> twin;
    FixedValues values = ToyValues();
    Manner manner;
    std::size_t answered = 0;
  };

  /// `others`: devices on the wire that are not configured on the line. In twin(), their indices
  /// follow the indices of the line's devices.
  VirtualLine(config::Line line, std::vector<const protocols::Protocol*> protocols,
              std::vector<config::Device> others = {});
  ~VirtualLine() override;

  void Open();
  void Close();
  /// Ends the program and starts it again. The devices, the serial server and the values in the
  /// store stay as they are.
  void Restart();
  void RunFor(Duration time);
  /// Stops the program for `time`, as SIGSTOP does. Bytes that arrive meanwhile are delivered in
  /// one piece, before the due timers or after them.
  void Stop(Duration time, bool timers_first = false);
  /// Runs until `done` returns true, at most for `limit`. Returns the last result of `done`.
  bool RunUntil(const std::function<bool()>& done, Duration limit);
  /// Makes bytes arrive `after` this time from now, from any sender.
  void Inject(Bytes bytes, Duration after = {});
  /// Queues a write of one point; its result is appended to `ends`.
  bool Write(std::uint32_t device, std::uint32_t point, Value raw, Duration within = 1h);
  bool Submit(bus::WriteCommand command);
  void Submit(bus::RoutedRequest request);

  Now now() const { return {instant_, WallTime(1'790'000'000s) + (instant_ - kStart)}; }
  Duration elapsed() const { return instant_ - kStart; }
  WireTwin& twin(std::size_t device) { return *twins_[device]; }
  bus::Poller& poller() { return *poller_; }
  bool asking() const;
  bus::PointStore& store() { return *store_; }
  const config::Config& config() const { return config_; }

  Quality QualityOf(std::uint32_t device, std::uint32_t point) const;
  Value ValueOf(std::uint32_t device, std::uint32_t point) const;
  std::optional<Duration> AgeOf(std::uint32_t device, std::uint32_t point) const;
  bus::DeviceStatus StatusOf(std::uint32_t device) const;
  std::size_t CountSent(std::string_view start) const;

  bool keep_sent = true;       ///< false in runs that are too long to store all requests
  bool keeps_bit_rate = true;  ///< false: a pty or a network; set it before Open()
  std::vector<Sent> sent;
  bool holds = false;  ///< true: bytes wait, because the port has no connection
  std::size_t dropped = 0;
  std::vector<StateChange> states;
  std::vector<std::string> warnings;
  std::vector<WriteEnd> ends;
  /// Returns the echo of a request, which the bus returns character by character; empty: no echo.
  std::function<Bytes(View request)> echo;
  /// Returns what arrives, and when, from a serial server before all devices. Its arguments are a
  /// request and the replies of the devices, empty if they are silent. It replaces the Manner of
  /// each device, except `dead` and `instead`.
  std::function<std::vector<tools::TimedPiece>(View request, Bytes reply, Instant end_of_request)>
      server;
  /// Time that the disk takes to store a batch of events. Restart() loses a batch that is not
  /// stored yet.
  Duration keep_time = 5ms;
  /// Returns whether the batch was stored; if not, it is called again after a second. Empty:
  /// batches are appended to `events`.
  std::function<bool(const bus::ReportedEvents& reported)> keep;
  std::vector<bus::ReportedEvents> events;
  /// Called when the program starts. Returns EventBatch::said of the device's last saved batch. An
  /// empty string or an empty function says that no batch was saved.
  std::function<std::string(std::uint32_t device)> said;
  /// OnDrained and OnRead of PollerListener call these functions. The poller is running then, so
  /// they must not call it.
  std::function<void(std::uint32_t device, Instant asked)> drained;
  std::function<void(std::uint32_t device, Instant at)> read;
  std::function<void()> always;

 private:
  static constexpr Instant kStart = Instant() + 1h;

  void Send(View bytes, const config::SerialSettings& serial, Now now) override;
  void DropUnsent() override { ++dropped; }
  bool IsUnsent() const override { return unsent_; }
  void OnDeviceState(std::uint32_t device, bus::DeviceState from, bus::DeviceState to,
                     const std::string& reason, Now at) override;
  void OnEvents(bus::ReportedEvents reported) override;
  void OnDrained(std::uint32_t device, Instant asked) override {
    if (drained) drained(device, asked);
  }
  void OnRead(std::uint32_t device, std::span<const std::uint32_t>, Now at) override {
    if (read) read(device, at.instant);
  }
  void OnWarning(std::uint32_t, const std::string& message) override {
    warnings.push_back(message);
  }

  void Step(Instant until);
  void Deliver(const Manner& manner, Bytes reply, Instant from, Duration character);
  void Deliver(const tools::TimedPiece& piece, std::size_t fragment, Instant end_of_request,
               Duration character);

  void MakePoller();

  config::Config config_;
  const std::function<const protocols::Protocol&(const std::string& name)> find_;
  std::vector<config::Device> others_;
  Instant instant_ = kStart;
  std::vector<std::unique_ptr<WireTwin>> twins_;
  std::multimap<Instant, Bytes> arriving_;
  std::multimap<Instant, bus::ReportedEvents> keeping_;
  std::unique_ptr<bus::PointStore> store_;
  std::unique_ptr<bus::Poller> poller_;
  bool open_ = false;
  std::uint64_t sends_ = 0;
  bool unsent_ = false;
};

inline void PrintTo(Quality quality, std::ostream* out) { *out << Name(quality); }
inline void PrintTo(Outcome outcome, std::ostream* out) { *out << Name(outcome); }

config::Device ToyDevice(std::string name, std::string address, std::vector<std::string> reads);
config::Line ToyLine(std::vector<config::Device> devices);

}  // namespace baudgate

namespace baudgate::bus {

inline void PrintTo(DeviceState state, std::ostream* out) { *out << Name(state); }

}  // namespace baudgate::bus
