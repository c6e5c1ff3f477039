// The installation that transparent routes are for: an inverter behind RS-485 at 19200 8E1, and a
// PLC that fires five messages again and again, transfers whole parameter blocks, and starts and
// stops the motor. Checks the line while it measures how soon a start shows in the frequency.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include "gateway/base/text.h"
#include "gateway/daemon/daemon.h"
#include "gateway/simulate/pty.h"
#include "tests/bench/bare_gateway.h"
#include "tests/bench/bench.h"
#include "tests/support/raw_client.h"

namespace baudgate::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kThink = 5ms;
constexpr Duration kPeriod = 30ms;  // of the five messages, nominal
constexpr Duration kBetweenEvents = 700ms;
constexpr int kEvents = 25;  // starts, and as many stops
constexpr std::uint16_t kRunCommand = 8;
constexpr std::uint16_t kSetFrequency = 13;
constexpr std::uint16_t kFrequency = 200;
constexpr std::array<std::uint16_t, 9> kBlocks = {999,  1119, 1239, 1359, 1479,
                                                  1599, 1719, 1839, 1959};

/// The inverter's registers: the frequency follows the run command.
class DriveValues final : public TwinValues {
 public:
  explicit DriveValues(const config::Device& device) {
    for (std::size_t i = 0; i < device.points.size(); ++i) index_[device.points[i].name] = i;
  }
  Value Get(std::size_t point, Instant) const override {
    if (point == index_.at("output_frequency")) {
      return running_ ? set_frequency_ : Value(std::uint64_t{0});
    }
    if (point == index_.at("set_frequency")) return set_frequency_;
    return std::uint64_t{0};
  }
  void Set(std::size_t point, const Value& value) override {
    if (point == index_.at("set_frequency")) set_frequency_ = value;
    if (point == index_.at("status_word")) running_ = ToDouble(value) != 0;
  }

 private:
  static double ToDouble(const Value& value) {
    if (const auto* whole = std::get_if<std::uint64_t>(&value)) return static_cast<double>(*whole);
    if (const auto* number = std::get_if<std::int64_t>(&value)) return static_cast<double>(*number);
    const auto* real = std::get_if<double>(&value);
    return real != nullptr ? *real : 0;
  }

  std::map<std::string, std::size_t> index_;
  Value set_frequency_ = std::uint64_t{2500};
  bool running_ = false;
};

/// One request as the slave saw it.
struct OnWire {
  Instant from;
  std::string pdu;
};

/// The inverter at the far end of a pty: keeps the bit rate, thinks for 5 ms, delivers long replies
/// in fragments, and watches that nobody talks out of turn.
class Drive {
 public:
  Drive(const Protocol& rtu, const config::Device& device, const config::SerialSettings& serial)
      : pty_(std::move(*Pty::Create())),
        character_(serial.CharacterTime()),
        values_(device),
        twin_(rtu.make_twin(device, values_)),
        thread_([this] { Run(); }) {}
  ~Drive() {
    stop_ = true;
    thread_.join();
  }

  const std::string& path() const { return pty_.path(); }
  std::vector<OnWire> log() const {
    const std::lock_guard lock(mutex_);
    return log_;
  }
  std::atomic<int> overlaps = 0;        ///< bytes that came before an exchange was over
  std::atomic<int> short_silences = 0;  ///< less than 3.5 characters between a reply and a request
  std::atomic<std::uint64_t> bytes_in = 0;
  std::atomic<std::uint64_t> bytes_out = 0;

 private:
  void Run() {
    prctl(PR_SET_TIMERSLACK, 1UL);
    Bytes buffer(512);
    Instant quiet_since{};
    while (!stop_) {
      pollfd ready{pty_.master(), POLLIN, 0};
      if (poll(&ready, 1, 100) <= 0) continue;
      const Instant from = Clock::now();
      const ssize_t count = read(pty_.master(), buffer.data(), buffer.size());
      if (count <= 0) continue;
      const View request = View(buffer).first(static_cast<std::size_t>(count));
      bytes_in += request.size();
      if (from - quiet_since < 7 * character_ / 2) ++short_silences;
      {
        const std::lock_guard lock(mutex_);
        log_.push_back(
            {from, ToHex(request.subspan(1, std::min<std::size_t>(request.size() - 3, 5)))});
      }
      quiet_since =
          Answer(request, from + static_cast<std::int64_t>(request.size()) * character_ + kThink);
    }
  }

  /// Says when the last byte went out, rather too early than too late.
  Instant Answer(View request, Instant begin) {
    std::this_thread::sleep_until(begin);
    const Bytes reply = twin_->Answer(request, Clock::now());
    View rest = reply;
    Instant at = begin;
    while (!rest.empty()) {
      const View piece = rest.first(std::min<std::size_t>(rest.size(), 32));
      at += static_cast<std::int64_t>(piece.size()) * character_;
      std::this_thread::sleep_until(at);
      pollfd ready{pty_.master(), POLLIN, 0};
      if (poll(&ready, 1, 0) > 0) ++overlaps;
      at = Clock::now();
      if (write(pty_.master(), piece.data(), piece.size()) < 0) return at;
      bytes_out += piece.size();
      rest = rest.subspan(piece.size());
    }
    return at;
  }

  Pty pty_;
  const Duration character_;
  DriveValues values_;
  std::unique_ptr<Twin> twin_;
  mutable std::mutex mutex_;
  std::vector<OnWire> log_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

Bytes Adu(std::uint16_t transaction, const std::string& pdu) {
  const Bytes body = ParseHex(pdu).value();
  Bytes frame;
  const auto put = [&frame](std::size_t word) {
    frame.push_back(static_cast<std::uint8_t>(word >> 8));
    frame.push_back(static_cast<std::uint8_t>(word));
  };
  put(transaction);
  put(0);
  put(body.size() + 1);
  frame.push_back(20);
  Append(frame, body);
  return frame;
}

std::string Read(std::uint16_t address, std::uint16_t count) {
  return fmt::format("03 {:02X} {:02X} {:02X} {:02X}", address >> 8, address & 0xFF, count >> 8,
                     count & 0xFF);
}
std::string Write(std::uint16_t address, std::uint16_t value) {
  return fmt::format("06 {:02X} {:02X} {:02X} {:02X}", address >> 8, address & 0xFF, value >> 8,
                     value & 0xFF);
}
std::string WriteBlock() {
  std::string pdu = "10 03 E7 00 78 F0";
  for (int i = 0; i < 240; ++i) pdu += " 00";
  return pdu;
}

/// The PLC: a message is fired again when its period has come and its last answer is there.
class Plc {
 public:
  /// `watch_port`: where the frequency is asked for.
  Plc(std::uint16_t port, std::uint16_t watch_port, bool blocks)
      : client_(port), watch_(watch_port), blocks_(blocks) {
    cyclic_ = {{Read(500, 1)},
               {Read(kFrequency, 1)},
               {Read(201, 1)},
               {Read(kRunCommand, 1)},
               {Write(kSetFrequency, 2500)}};
  }

  void Run() {
    Instant next_event = Clock::now() + kBetweenEvents;
    int events = 0;
    bool running = false;
    while (events < 2 * kEvents) {
      const Instant now = Clock::now();
      for (Message& message : cyclic_) Fire(message, now);
      if (blocks_) FireBlocks();
      if (now >= next_event) {
        running = !running;
        starts_pending_ = running ? std::optional(now) : std::nullopt;
        if (running) starts.push_back({Clock::now(), {}});
        Send(Write(kRunCommand, running ? 2 : 0), nullptr);
        next_event = now + kBetweenEvents;
        ++events;
      }
      Receive();
    }
  }

  struct Start {
    Instant sent;
    std::optional<Instant> seen;  ///< the first frequency that is not zero
  };
  std::vector<Start> starts;
  int mismatches = 0;
  int exceptions = 0;
  std::uint64_t answered = 0;

 private:
  struct Message {
    std::string pdu;
    bool waits = false;
    Instant next{};
  };
  struct Sent {
    std::string pdu;
    Message* message;
  };

  void Fire(Message& message, Instant now) {
    if (message.waits || now < message.next) return;
    message.waits = true;
    message.next = now + kPeriod;
    Send(message.pdu, &message);
  }

  /// Nine reads and one write of a block, over and over.
  void FireBlocks() {
    if (block_.waits) return;
    block_.waits = true;
    const std::size_t turn = block_turn_++ % (kBlocks.size() + 1);
    const auto count = static_cast<std::uint16_t>(turn == kBlocks.size() - 1 ? 40 : 120);
    Send(turn < kBlocks.size() ? Read(kBlocks[turn], count) : WriteBlock(), &block_);
  }

  void Send(const std::string& pdu, Message* message) {
    sent_[++transaction_] = {pdu, message};
    const RawClient& client = message == &cyclic_[1] ? watch_ : client_;
    client.Send(Adu(transaction_, pdu));
  }

  void Receive() {
    pollfd ready[] = {{client_.socket(), POLLIN, 0}, {watch_.socket(), POLLIN, 0}};
    while (poll(ready, 2, 1) > 0) {
      const bool watched = (ready[1].revents & POLLIN) != 0;
      const Bytes reply = (watched ? watch_ : client_).ReceiveFrame();
      const Instant now = Clock::now();
      if (reply.size() < 9) std::exit(4);
      const auto found = sent_.find(static_cast<std::uint16_t>(reply[0] << 8 | reply[1]));
      if (found == sent_.end()) {
        ++mismatches;
        continue;
      }
      ++answered;
      const Sent sent = found->second;
      sent_.erase(found);
      if (sent.message != nullptr) sent.message->waits = false;
      if ((reply[7] & 0x80) != 0) ++exceptions;
      if ((reply[7] & 0x7F) != ParseHex(sent.pdu).value()[0]) ++mismatches;
      const bool frequency = sent.message == &cyclic_[1] && reply.size() == 11;
      if (frequency && starts_pending_ && (reply[9] != 0 || reply[10] != 0)) {
        starts.back().seen = now;
        starts_pending_.reset();
      }
    }
  }

  RawClient client_;
  RawClient watch_;
  bool blocks_;
  std::vector<Message> cyclic_;
  Message block_;
  std::size_t block_turn_ = 0;
  std::uint16_t transaction_ = 0;
  std::map<std::uint16_t, Sent> sent_;
  std::optional<Instant> starts_pending_;
};

/// Requests that began on the line after a start was sent and before the start itself, and were no
/// writes: the exchange under way at most may stand before it, and that has begun already.
int ReadsBefore(const std::vector<OnWire>& log, Instant sent) {
  int reads = 0;
  for (const OnWire& request : log) {
    if (request.from < sent) continue;
    if (request.pdu == ToHex(ParseHex(Write(kRunCommand, 2)).value())) return reads;
    const bool on_its_way = request.from < sent + 1ms;  // the start, through the gateway
    if (request.pdu.starts_with("03") && !on_its_way) ++reads;
  }
  return reads;
}

double Milliseconds(Duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

struct Setup {
  const char* name;
  bool blocks;
  bool high;  ///< the frequency is asked for on a listener of high priority
};

void Measure(const config::Catalog& catalog, const Setup& setup) {
  std::string points;
  for (const std::uint16_t block : kBlocks) {
    points += fmt::format(
        "{{ name: block_{0}, read: \"holding {0}\", type: uint16, access: rw }}, ", block + 37);
  }
  const config::Config twin = Load(
      "modbus: { enabled: false }\ndds: { enabled: false }\nlines:\n  - { name: drive, port: "
      "/dev/null, serial: 19200 8E1, protocol: modbus_rtu, devices: [ { name: drive, address: 20, "
      "profile: mitsubishi-fr-d700, points: [ " +
          points + "] } ] }\n",
      catalog);
  Drive drive(*catalog.FindProtocol("modbus_rtu"), twin.lines[0].devices[0], twin.lines[0].serial);
  const std::uint16_t port = BareGateway("/dev/null").port();
  const std::uint16_t high_port = BareGateway("/dev/null").port();
  Daemon daemon(
      Load(
          fmt::format("dds: {{ enabled: false }}\nmodbus:\n"
                      "  listen: [ \"127.0.0.1:{}\", {{ at: \"127.0.0.1:{}\", priority: high }} ]\n"
                      "  routes: [ {{ units: \"20\", line: drive }} ]\n"
                      "lines:\n  - {{ name: drive, port: {}, serial: 19200 8E1, protocol: "
                      "modbus_rtu }}\n",
                      port, high_port, drive.path()),
          catalog),
      catalog);
  if (!daemon.Start()) std::exit(4);
  std::this_thread::sleep_for(200ms);
  Plc plc(port, setup.high ? high_port : port, setup.blocks);
  plc.Run();
  std::this_thread::sleep_for(1s);
  const auto log = drive.log();
  std::vector<double> times;
  int overtaken = 0;
  for (const Plc::Start& start : plc.starts) {
    if (start.seen) times.push_back(Milliseconds(*start.seen - start.sent));
    overtaken = std::max(overtaken, ReadsBefore(log, start.sent));
  }
  const LineStatus line = daemon.store().ReadLine(0);
  const bool counted = line.bytes_out == drive.bytes_in && line.bytes_in == drive.bytes_out &&
                       line.exchanges == log.size();
  const bool clean = plc.mismatches == 0 && drive.overlaps == 0 && drive.short_silences == 0 &&
                     overtaken == 0 && counted && times.size() == plc.starts.size();
  const auto in_time = std::ranges::count_if(times, [](double time) { return time <= 70; });
  fmt::print(
      "  {:<24} {} starts, frequency seen after {:.0f} ms in the median ({:.0f} to {:.0f}), {} "
      "within 70 ms\n",
      setup.name, times.size(), Median(times), Percentile(times, 0), Percentile(times, 1), in_time);
  fmt::print(
      "    {} answers, {} exceptions, {} wrong ids, {} overlaps, {} short silences, at most {} "
      "reads before a start, counters {}  {}\n",
      plc.answered, plc.exceptions, plc.mismatches, drive.overlaps.load(),
      drive.short_silences.load(), overtaken, counted ? "equal the traffic" : "DIFFER",
      Verdict(clean));
}

}  // namespace

void RunDrive(const config::Catalog& catalog) {
  fmt::print(
      "an inverter at 19200 8E1 that answers after 5 ms, a PLC with five messages every {} ms\n",
      kPeriod / 1ms);
  constexpr Setup kSetups[] = {{"cyclic messages only", false, false},
                               {"and whole blocks", true, false},
                               {"cyclic, frequency apart", false, true},
                               {"blocks, frequency apart", true, true}};
  for (const Setup& setup : kSetups) Measure(catalog, setup);
}

}  // namespace baudgate::bench
