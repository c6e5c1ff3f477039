// One whole line in a test under virtual time: the poller, a wire that knows its bit rate, and the
// twins of all devices on it, whose manners a test spoils as it likes. Time jumps from event to
// event; nothing here knows a real clock. Works with the toy protocol and with the real plugins:
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

/// How a device behaves on the wire, whatever it has to say. May change at any time.
struct Manner {
  bool dead = false;
  Duration think = 5ms;      ///< end of the request to first byte of the reply
  std::size_t fragment = 0;  ///< bytes that arrive together; 0: the whole reply at once, when its
                             ///< last byte is through
  Duration pause{};          ///< silence between fragments, beyond the time of their characters
  int copies = 1;            ///< the reply comes so often, one after the other
  Duration babble{};         ///< noise for so long in place of a reply
  std::function<Bytes(Bytes reply)> distort;  ///< damage
  /// What it says in place of the twin's answer; nothing: the twin's answer stands. Not asked about
  /// requests that the twin leaves unanswered, such as those to other devices.
  std::function<std::optional<Bytes>(View request)> instead;
  /// In place of everything above but `dead` and `fragment`: what arrives, and when. Asked about
  /// every request on the line; `reply` is empty where the twin has none. See
  /// gateway/tools/simulate/twin_faults.h.
  std::function<std::vector<tools::TimedPiece>(View request, Bytes reply, Instant end_of_request)>
      deliver;
};

struct Sent {
  Instant at;
  std::string text;  ///< the request's bytes as characters
};

struct StateChange {
  Instant at;
  std::uint32_t device = 0;
  bus::DeviceState to = bus::DeviceState::never_seen;
};

/// For messages of failed tests.
inline void PrintTo(WriteEnd end, std::ostream* out) { *out << Name(end); }

class VirtualLine : private bus::RequestPort, private bus::PollerListener {
 public:
  struct WireTwin {
    std::unique_ptr<protocols::Twin> twin;
    FixedValues values = ToyValues();
    Manner manner;
    std::size_t answered = 0;
  };

  /// `others`: devices on the wire that the line does not know of; their twins come last.
  VirtualLine(config::Line line, std::vector<const protocols::Protocol*> protocols,
              std::vector<config::Device> others = {});
  ~VirtualLine() override;

  void Open();
  void Close();
  /// The program ends and is started again, while whatever is before the devices goes on. What the
  /// store holds stays: who judges it sees one history.
  void Restart();
  void RunFor(Duration time);
  /// The program is stopped for so long, as by SIGSTOP: what arrives meanwhile comes in one piece
  /// when it goes on, before its timers or behind them.
  void Stop(Duration time, bool timers_first = false);
  /// Until `done` is true, at most for `limit`; says whether it became true.
  bool RunUntil(const std::function<bool()>& done, Duration limit);
  /// Bytes that arrive `after` from now, whoever sent them.
  void Inject(Bytes bytes, Duration after = {});
  /// A write of one point through the command queue; its answer goes to `ends`.
  bool Write(std::uint32_t device, std::uint32_t point, Value raw, Duration within = 1h);
  bool Submit(bus::WriteCommand command);
  void Submit(bus::RoutedRequest request);

  Now now() const { return {instant_, WallTime(1'790'000'000s) + (instant_ - kStart)}; }
  Duration elapsed() const { return instant_ - kStart; }
  WireTwin& twin(std::size_t device) { return *twins_[device]; }
  bus::Poller& poller() { return *poller_; }
  /// An exchange is under way: a request went out and has not ended.
  bool asking() const;
  bus::PointStore& store() { return *store_; }
  const config::Config& config() const { return config_; }

  Quality QualityOf(std::uint32_t device, std::uint32_t point) const;
  Value ValueOf(std::uint32_t device, std::uint32_t point) const;
  std::optional<Duration> AgeOf(std::uint32_t device, std::uint32_t point) const;
  bus::DeviceStatus StatusOf(std::uint32_t device) const;
  /// Requests that began with `start`.
  std::size_t CountSent(std::string_view start) const;

  bool keep_sent = true;       ///< cleared by runs that are too long for it
  bool keeps_bit_rate = true;  ///< false: a pty or a network. Before Open
  std::vector<Sent> sent;
  bool holds = false;       ///< what is sent waits for a connection
  std::size_t dropped = 0;  ///< requests of which the port was to drop what was unsent
  std::vector<StateChange> states;
  std::vector<std::string> warnings;
  std::vector<WriteEnd> ends;  ///< of Write, in the order of their answers
  /// What the bus gives back of a request while it is sent, character by character; nothing: this
  /// bus does not echo.
  std::function<Bytes(View request)> echo;
  /// What a serial server before all devices makes of a request and of what they say to it, empty
  /// where they are silent: what arrives, and when. In place of all manners but `dead` and
  /// `instead`.
  std::function<std::vector<tools::TimedPiece>(View request, Bytes reply, Instant end_of_request)>
      server;
  /// So long the disk takes for a batch of events; a kill loses what it has not taken yet.
  Duration keep_time = 5ms;
  /// Whether it has; if not, it is asked again after a second. Without it they go to `events`.
  std::function<bool(const bus::ReportedEvents& reported)> keep;
  std::vector<bus::ReportedEvents> events;  ///< that were kept, in their order
  /// What the store of events holds at a start of what the device has said last; without it
  /// nothing.
  std::function<std::string(std::uint32_t device)> said;
  /// See PollerListener; within the poller, which must not be called from here.
  std::function<void(std::uint32_t device, Instant asked)> drained;
  std::function<void(std::uint32_t device, Instant at)> read;
  /// Looks at the line after every event, for what must hold at any time.
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
  bool unsent_ = false;  // see RequestPort
};

inline void PrintTo(Quality quality, std::ostream* out) { *out << Name(quality); }
inline void PrintTo(Outcome outcome, std::ostream* out) { *out << Name(outcome); }

/// A device with one fast point for each `read`, polled every second.
config::Device ToyDevice(std::string name, std::string address, std::vector<std::string> reads);
config::Line ToyLine(std::vector<config::Device> devices);

}  // namespace baudgate

namespace baudgate::bus {

inline void PrintTo(DeviceState state, std::ostream* out) { *out << Name(state); }

}  // namespace baudgate::bus
