// What the user configured, as plain structs: no YAML here, every value already checked.
// Filled by config/loader.h; read by everybody else.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gateway/base/quality.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate::config {

/// Where something stands in a file, for messages: "file:line:column". Line 0 = not from a file.
struct Mark {
  std::string file;
  int line = 0;
  int column = 0;

  std::string ToString() const;
};

// ---------------------------------------------------------------- points

enum class Type : std::uint8_t {
  boolean,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string
};
enum class Access : std::uint8_t { read, write, read_write };
enum class Group : std::uint8_t { once, slow, fast };
/// Which pair of Modbus tables a point lives in: registers (FC 3 and 4) or bits (FC 1 and 2).
enum class Table : std::uint8_t { registers, bits };

/// A raw value that the device sends in place of a measurement, and the quality it means.
struct Sentinel {
  double value = 0;
  Quality quality = Quality::bad_sensor_failure;
};

/// What a register shows while its channel has a fault (design: on_fault: nan | hold | VALUE).
struct OnFault {
  enum class Kind : std::uint8_t { automatic, nan, hold, value } kind = Kind::automatic;
  double value = 0;
};

/// What a twin answers for this point: a fixed value, or a slow wave between two numbers.
struct Simulate {
  double low = 0;
  double high = 0;
  std::optional<std::string> text;
};

struct Point {
  std::string name;
  std::string read;   ///< the protocol's own address; checked by the plugin
  std::string write;  ///< where it differs from read, else empty
  Type type = Type::float32;
  std::size_t text_length = 0;  ///< of string(n), bytes
  std::string unit;             ///< of the value after scale and offset: "A", "xIn"
  Access access = Access::read;
  Group group = Group::fast;
  std::optional<std::uint16_t> modbus;  ///< 0-based PDU address; nothing = not on Modbus
  Table table = Table::registers;
  double scale = 1;  ///< value = raw * scale + offset
  double offset = 0;
  std::vector<Sentinel> sentinels;  ///< compared with the raw value
  OnFault on_fault;
  double deadband = 0;  ///< DDS: smaller changes are not published, in units of the value
  std::optional<Simulate> simulate;
  std::string description;
  Mark mark;
};

// ---------------------------------------------------------------- options of a protocol

/// One option of a protocol, already of the kind that its OptionSpec demands. Durations are held in
/// nanoseconds as integers.
using OptionValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::string>>;

/// The options of one device or line. Every option that the protocol declares is present: given by
/// the user, by the profile, or its default. The getters therefore need no fallback; asking for a
/// name that was not declared, or for another kind, is a programming error (std::bad_variant_access
/// or std::out_of_range in tests).
class Options {
 public:
  void Set(std::string name, OptionValue value) { values_[std::move(name)] = std::move(value); }
  bool Has(const std::string& name) const { return values_.contains(name); }
  bool Flag(const std::string& name) const { return std::get<bool>(values_.at(name)); }
  std::int64_t Integer(const std::string& name) const {
    return std::get<std::int64_t>(values_.at(name));
  }
  double Real(const std::string& name) const { return std::get<double>(values_.at(name)); }
  const std::string& Text(const std::string& name) const {
    return std::get<std::string>(values_.at(name));
  }
  const std::vector<std::string>& Texts(const std::string& name) const {
    return std::get<std::vector<std::string>>(values_.at(name));
  }
  Duration Time(const std::string& name) const { return Duration(Integer(name)); }
  const std::map<std::string, OptionValue>& all() const { return values_; }

 private:
  std::map<std::string, OptionValue> values_;
};

// ---------------------------------------------------------------- lines and devices

enum class Parity : std::uint8_t { none, even, odd };

struct Rs485 {
  bool enabled = false;
  Duration delay_before_send{};  ///< RTS to first bit; the driver knows milliseconds only
  Duration delay_after_send{};
  bool rts_active_high = true;
  bool receive_while_sending = false;
};

struct SerialSettings {
  int baud = 9600;    ///< bit/s, 300…921600, non-standard rates included
  int data_bits = 8;  ///< 7 or 8
  Parity parity = Parity::none;
  int stop_bits = 1;             ///< 1 or 2
  bool software_parity = false;  ///< the port does 8N1 only: parity is made and checked here
  bool rtscts = false;
  bool low_latency = true;  ///< ask the driver to deliver bytes at once
  Rs485 rs485;

  /// Start, data, parity and stop bits of one character.
  int BitsPerCharacter() const {
    return 1 + data_bits + (parity == Parity::none ? 0 : 1) + stop_bits;
  }
  Duration CharacterTime() const { return Duration(1'000'000'000LL * BitsPerCharacter() / baud); }
  /// "9600 7E1".
  std::string ToString() const;
};

/// The named times of a line (docs/timeouts.md). Nothing = decided one level up.
struct Timing {
  std::optional<Duration> quiet;    ///< silence before sending
  std::optional<Duration> reply;    ///< end of request to first byte of the reply
  std::optional<Duration> gap;      ///< longest silence inside a frame
  std::optional<Duration> ceiling;  ///< whole exchange, from the end of the request
  std::optional<Duration> drain;    ///< silence that ends a drain
};

/// `first` wins where it says something, else `second`.
Timing Merge(const Timing& first, const Timing& second);

/// What a device is really timed with: `given` over `fallback`, which has every field. Who allows
/// more time to begin a reply but does not say how long the whole exchange may take, lengthens that
/// alike; and it is never shorter than reply and gap.
Timing Resolve(const Timing& given, const Timing& fallback);

/// What gateway, line, profile and device may each say about times. Nothing = decided one level up.
struct Pace {
  Timing timing;
  std::optional<int> retries;
  std::optional<Duration> poll;
  std::optional<Duration> slow;
};

/// Key by key: `first` wins where it says something, else `second`.
Pace Merge(const Pace& first, const Pace& second);

enum class Echo : std::uint8_t { off, strip, verify };
enum class OnBad : std::uint8_t { exception, hold, nan };
/// Order of the bytes of a 32-bit value 0xAABBCCDD in two registers; 64-bit values alike.
enum class WordOrder : std::uint8_t { abcd, cdab, badc, dcba };

struct Device {
  std::string name;
  std::string address;               ///< as written; the plugin reads it
  std::string protocol;              ///< the line's, unless the device names its own
  std::string profile;               ///< empty when all points stand inline
  std::string title;                 ///< the profile's `device:`
  std::optional<std::uint8_t> unit;  ///< Modbus unit id 1…247; nothing = not on Modbus
  bool enabled = true;
  Duration poll = std::chrono::seconds(1);  ///< period of the fast group
  Duration slow = std::chrono::minutes(1);  ///< period of the slow group
  std::optional<Duration> max_age;          ///< nothing: 3 x the point's period
  std::optional<Duration> dead_age;         ///< nothing: 3 x max_age
  OnBad on_bad = OnBad::exception;
  WordOrder word_order = WordOrder::abcd;
  std::optional<int> retries;  ///< device before profile; nothing: the line's
  Timing timing;               ///< device before profile; the line's and the protocol's come below
  std::optional<SerialSettings> serial;  ///< where the bus is switched for this device
  Options options;                       ///< the protocol's own
  std::vector<Point> points;             ///< profile and inline points merged
  Mark mark;
};

struct Line {
  std::string name;
  std::string port;  ///< /dev/…, a pty's path, or tcp://host:port
  SerialSettings serial;
  std::string protocol;
  Timing timing;    ///< line before gateway
  int retries = 2;  ///< of exchanges that may be repeated
  Echo echo = Echo::off;
  Options options;
  std::vector<Device> devices;
  Mark mark;
};

// ---------------------------------------------------------------- outputs

enum class Priority : std::uint8_t { low, normal, high };

/// An address range in CIDR form; a single address is its own range.
struct Network {
  std::string text;                      ///< as written: "10.0.0.0/8"
  std::array<std::uint8_t, 16> bytes{};  ///< IPv4 in the last four
  int prefix = 128;                      ///< over all 16 bytes; IPv4 /8 is 104
};

/// What a listener's clients may ask for. Others get exception 0x01.
enum class Permit : std::uint8_t {
  read,  ///< functions 1-4
  data,  ///< functions 1-6, 15 and 16
  all,
};

/// Clients of some addresses have a priority of their own; the first that fits decides.
struct ClientPriority {
  Network from;
  Priority priority = Priority::normal;
};

/// So have some functions, whoever asks: over the client's and the listener's.
struct FunctionPriority {
  std::vector<std::uint8_t> codes;
  Priority priority = Priority::normal;
};

/// Where Modbus masters come in: a TCP port, or a serial port at which a master waits.
struct Listener {
  enum class Protocol : std::uint8_t { tcp, rtu };  ///< rtu over TCP, too: one request at a time
  enum class Errors : std::uint8_t {
    exception,  ///< 0x0A, 0x0B and 0x06 are answered
    silent,     ///< nothing is answered in their place
  };
  /// What becomes of a write to unit 0 that no route names.
  enum class Broadcast : std::uint8_t {
    ignore,  ///< it is for the gateway, which has nothing to write: exception 0x02
    pass,    ///< to all slaves of every line that a route leads to; never answered
  };
  std::string host = "127.0.0.1";
  std::uint16_t port = 1502;
  std::string path;       ///< of the serial port; then host and port mean nothing
  SerialSettings serial;  ///< of the serial port
  Protocol protocol = Protocol::tcp;
  std::vector<Network> allow;  ///< empty = everybody
  Permit permit = Permit::all;
  Priority priority = Priority::normal;
  std::vector<ClientPriority> clients;
  std::vector<FunctionPriority> functions;
  Errors errors = Errors::exception;  ///< the loader makes it silent for serial ports
  Broadcast broadcast = Broadcast::ignore;
  int max_clients = 256;
  Duration idle_timeout = std::chrono::minutes(5);
  Mark mark;

  bool is_serial() const { return !path.empty(); }
  /// "0.0.0.0:502", "[::1]:502" or "/dev/ttyS1".
  std::string Place() const;
};

/// Where requests for some units go as they are: to a line, or to a Modbus TCP server elsewhere.
/// Units of devices come first, then the first route that names the unit.
struct Route {
  std::uint8_t first = 1;  ///< unit ids, 0…255; 0 only when it is written
  std::uint8_t last = 1;
  std::string line;            ///< name of a line whose protocol carries Modbus, or empty
  std::size_t line_index = 0;  ///< in Config::lines, when `line` is not empty
  std::string host;            ///< of the server, when `line` is empty
  std::uint16_t port = 502;
  std::optional<std::uint8_t> remap;  ///< `first` becomes this address, the next unit the next
  /// From the request's arrival to the end of its reply, queueing included; not sent later.
  Duration deadline = std::chrono::milliseconds(2500);
  Mark mark;

  bool Covers(std::uint8_t unit) const { return unit >= first && unit <= last; }
  /// The address on the line, or the unit id at the server.
  std::uint8_t SlaveOf(std::uint8_t unit) const;
  /// "33-40".
  std::string Units() const;
  /// "line drive" or "server 10.0.0.9:502".
  std::string Target() const;
};

struct Modbus {
  bool enabled = true;
  std::vector<Listener> listen;
  std::vector<Route> routes;  ///< first match wins
};

struct Dds {
  bool enabled = true;
  int domain = 0;  ///< 0…232
  std::vector<std::string> interfaces = {"127.0.0.1"};
  bool shared_memory = false;
  Duration heartbeat = std::chrono::seconds(10);  ///< every point is published at least so often
};

struct Config {
  std::string name = "baudgate";  ///< gateway.name: the key of every DDS sample
  std::string recordings;         ///< folder of the flight recorder's files; empty = not given
  std::string socket;             ///< path of the local control socket; empty = not given
  Modbus modbus;
  Dds dds;
  std::vector<Line> lines;
};

/// A device type: title, options and points of config/profiles/<protocol>/<name>.yaml.
struct Profile {
  std::string name;
  std::string protocol;
  std::string title;
  Pace pace;
  std::optional<WordOrder> word_order;
  Options options;  ///< only those that the profile sets
  std::vector<Point> points;
};

// ---------------------------------------------------------------- names of things

std::string_view Name(Type type);  ///< "float32"; string without its length
std::string_view Name(Group group);
std::string_view Name(Access access);
std::string_view Name(WordOrder order);  ///< "ABCD"
std::string_view Name(Priority priority);
std::string_view Name(Permit permit);

/// Registers that a point takes in the register tables; 1 for a bit.
std::size_t RegisterCount(const Point& point);

/// Smallest and largest value of an integer type.
struct IntegerRange {
  std::int64_t lowest = 0;
  std::uint64_t highest = 0;

  /// For whole numbers; exact where `highest` itself has no double.
  bool Contains(double whole) const;
};

/// bool counts as 0…1; types that are no integers have only 0.
IntegerRange RangeOf(Type type);

}  // namespace baudgate::config
