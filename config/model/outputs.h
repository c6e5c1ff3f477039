// The outputs of the gateway: Modbus on TCP and serial ports, DDS, and the web page. Listener and
// Route belong to Modbus, DdsSecurity to Dds, and Web is the web page.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/events.h"
#include "config/model/fields.h"
#include "config/model/modbus.h"
#include "config/model/network.h"
#include "config/model/problem.h"
#include "config/model/serial.h"
#include "gateway/base/time.h"

namespace baudgate::config {

// Where Modbus masters come in, and what they may do.
enum class Priority : std::uint8_t { low, normal, high };

/// The requests that clients of a listener may send. Others get exception 0x01.
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

template <typename Visit>
void VisitFields(const ClientPriority*, Visit visit) {
  visit(Field<&ClientPriority::from>());
  visit(Field<&ClientPriority::priority>());
}

/// So have some functions, whoever asks: over the client's and the listener's.
struct FunctionPriority {
  std::vector<std::uint8_t> codes;
  Priority priority = Priority::normal;
};

template <typename Visit>
void VisitFields(const FunctionPriority*, Visit visit) {
  visit(Field<&FunctionPriority::codes>());
  visit(Field<&FunctionPriority::priority>());
}

/// Where Modbus masters come in: a TCP port, or a serial port at which a master waits.
struct Listener {
  enum class Errors : std::uint8_t {
    exception,  ///< 0x0A, 0x0B and 0x06 are answered
    silent,     ///< nothing is answered in their place
  };
  /// What becomes of a write to unit 0 that no route names.
  enum class Broadcast : std::uint8_t {
    ignore,  ///< it is for the gateway, which has nothing to write: exception 0x02
    pass,    ///< to all slaves of every line that a route leads to; never answered
  };
  /// What a read of a block finds at addresses between points.
  enum class Holes : std::uint8_t {
    off,   ///< exception 0x02
    zero,  ///< 0, where the block has a point at all
  };
  /// Whether the adapter at the serial port gives the gateway its own replies back as requests.
  enum class Echo : std::uint8_t { off, strip };
  std::string host = "127.0.0.1";
  std::uint16_t port = 1502;
  std::string path;       ///< of the serial port; then host and port mean nothing
  SerialSettings serial;  ///< of the serial port
  Echo echo = Echo::off;  ///< of the serial port
  modbus::Framing framing = modbus::Framing::tcp;  ///< of a serial port: rtu or ascii
  std::vector<Network> allow;                      ///< empty = everybody
  Permit permit = Permit::all;
  Priority priority = Priority::normal;
  std::vector<ClientPriority> clients;
  std::vector<FunctionPriority> functions;
  Errors errors = Errors::exception;  ///< the loader makes it silent for serial ports
  Broadcast broadcast = Broadcast::ignore;
  Holes holes = Holes::off;
  int max_clients = 256;
  Duration idle_timeout = std::chrono::minutes(5);
  Mark mark;

  bool is_serial() const { return !path.empty(); }
  /// Messages as on a serial line: they do not tell which request they answer, so there is one at a
  /// time.
  bool speaks_serial() const { return framing != modbus::Framing::tcp; }
  /// "0.0.0.0:502", "[::1]:502" or "/dev/ttyS1".
  std::string Address() const;
};

template <typename Visit>
void VisitFields(const Listener*, Visit visit) {
  visit(Field<&Listener::host>());
  visit(Field<&Listener::port>());
  visit(Field<&Listener::path>());
  visit(Field<&Listener::serial>());
  visit(Field<&Listener::echo>());
  visit(Field<&Listener::framing>());
  visit(Field<&Listener::allow>());
  visit(Field<&Listener::permit>{"write"});
  visit(Field<&Listener::priority>());
  visit(Field<&Listener::clients>());
  visit(Field<&Listener::functions>());
  visit(Field<&Listener::errors>());
  visit(Field<&Listener::broadcast>());
  visit(Field<&Listener::holes>());
  visit(Field<&Listener::max_clients>());
  visit(Field<&Listener::idle_timeout>());
  visit(Derived<&Listener::mark>());
}

std::string_view Name(Priority priority);
std::string_view Name(Permit permit);

// Where requests for units that are no devices go.

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
  AlarmSetting alarms;  ///< of each unit behind it; route before line and gateway
  Mark mark;

  bool Covers(std::uint8_t unit) const { return unit >= first && unit <= last; }
  /// The address on the line, or the unit id at the server.
  std::uint8_t SlaveOf(std::uint8_t unit) const;
  /// "33-40".
  std::string Units() const;
  /// "line drive" or "server 10.0.0.9:502".
  std::string Target() const;
};

template <typename Visit>
void VisitFields(const Route*, Visit visit) {
  visit(Field<&Route::first>{"units"});
  visit(Field<&Route::last>{"units"});
  visit(Field<&Route::line>());
  visit(Derived<&Route::line_index>());
  visit(Field<&Route::host>());
  visit(Field<&Route::port>());
  visit(Field<&Route::remap>());
  visit(Field<&Route::deadline>());
  visit(Field<&Route::alarms>());
  visit(Derived<&Route::mark>());
}

// Which files a DDS participant proves itself with, and by which it knows others (DDS
// Security 1.1).

/// Absolute paths; without `identity` DDS is open to everybody who reaches its ports.
struct DdsSecurity {
  std::string ca;              ///< certificates of the authority that issues identities
  std::string permissions_ca;  ///< of the one that signs the two documents; empty: `ca`
  std::string identity;        ///< the participant's certificate
  std::string key;             ///< its private key
  std::string password_file;   ///< holds the key's password; empty: it has none
  std::string governance;      ///< what is protected in the domain; signed
  std::string permissions;     ///< who may publish and subscribe what; signed
  Keys keys;                   ///< places in the configuration

  bool on() const { return !identity.empty(); }
  const std::string& signer() const { return permissions_ca.empty() ? ca : permissions_ca; }
};

template <typename Visit>
void VisitFields(const DdsSecurity*, Visit visit) {
  visit(Field<&DdsSecurity::ca>());
  visit(Field<&DdsSecurity::permissions_ca>());
  visit(Field<&DdsSecurity::identity>());
  visit(Field<&DdsSecurity::key>());
  visit(Field<&DdsSecurity::password_file>());
  visit(Field<&DdsSecurity::governance>());
  visit(Field<&DdsSecurity::permissions>());
  visit(Derived<&DdsSecurity::keys>());
}

/// The five files by the names that `baudgate certs dds` gives them.
inline DdsSecurity SecurityIn(const std::string& directory) {
  DdsSecurity security;
  security.ca = directory + "/ca.pem";
  security.identity = directory + "/identity.pem";
  security.key = directory + "/key.pem";
  security.governance = directory + "/governance.p7s";
  security.permissions = directory + "/permissions.p7s";
  return security;
}

// The web page, its JSON and its metrics (gateway/outputs/web): where it listens, and which clients
// may come.
struct Web {
  bool on = false;  ///< the key `web` is there
  HostPort listen{"127.0.0.1", 8502};
  std::vector<Network> allow;      ///< who may connect; empty = everybody
  std::vector<std::string> hosts;  ///< names of the gateway that browsers may use, in lower case
  std::string token_file;          ///< empty: nobody logs in
  bool acknowledge = false;        ///< alarms may be acknowledged
  Mark token_mark;                 ///< of token_file

  /// "127.0.0.1:8502", "[::1]:8502".
  std::string Address() const;
  bool on_loopback() const { return IsLoopback(ReachOf(listen.host)); }
};

template <typename Visit>
void VisitFields(const Web*, Visit visit) {
  visit(Field<&Web::on>{"web"});
  visit(Field<&Web::listen>());
  visit(Field<&Web::allow>());
  visit(Field<&Web::hosts>());
  visit(Field<&Web::token_file>{"token"});
  visit(Field<&Web::acknowledge>());
  visit(Derived<&Web::token_mark>());
}

struct Modbus {
  bool enabled = true;
  std::vector<Listener> listen;
  std::vector<Route> routes;  ///< first match wins
};

template <typename Visit>
void VisitFields(const Modbus*, Visit visit) {
  visit(Field<&Modbus::enabled>());
  visit(Field<&Modbus::listen>());
  visit(Field<&Modbus::routes>());
}

inline constexpr std::size_t kMostPeers = 64;

inline constexpr Duration kUsualLease = std::chrono::seconds(10);
inline constexpr Duration kShortestLease = std::chrono::seconds(2);
inline constexpr Duration kLongestLease = std::chrono::minutes(1);

struct Dds {
  bool enabled = true;
  int domain = 0;  ///< 0…232
  std::vector<std::string> interfaces = {"127.0.0.1"};
  bool multicast = true;           ///< ask the domain's multicast group, and listen to it
  std::vector<std::string> peers;  ///< IPv4 addresses, asked beside multicast; kMostPeers at most
  std::vector<HostPort> discovery_servers;  ///< IPv4; who announces himself there is introduced
  Duration heartbeat = std::chrono::seconds(10);  ///< every point is published at least so often
  Duration lease = kUsualLease;  ///< from its last sign of life until the gateway counts as gone
  DdsSecurity security;
  bool write = false;  ///< take write requests
};

template <typename Visit>
void VisitFields(const Dds*, Visit visit) {
  visit(Field<&Dds::enabled>());
  visit(Field<&Dds::domain>());
  visit(Field<&Dds::interfaces>());
  visit(Field<&Dds::multicast>());
  visit(Field<&Dds::peers>());
  visit(Field<&Dds::discovery_servers>());
  visit(Field<&Dds::heartbeat>());
  visit(Field<&Dds::lease>());
  visit(Field<&Dds::security>());
  visit(Field<&Dds::write>());
}

}  // namespace baudgate::config
