// The outputs of the gateway: Modbus on TCP and serial ports, DDS, MQTT and the web page. Listener
// and Route belong to Modbus, DdsSecurity to Dds. If the struct of a section has kReloads = true, a
// reload applies its settings; otherwise only a restart does.
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

enum class Priority : std::uint8_t { low, normal, high };

/// The requests that clients of a listener are allowed to send. Other requests get exception 0x01.
enum class Permit : std::uint8_t {
  read,  ///< functions 1-4
  data,  ///< functions 1-6, 15 and 16
  all,
};

/// The priority of clients from some addresses; the first entry that matches applies.
struct ClientPriority {
  Network from;
  Priority priority = Priority::normal;
};

template <typename Visit>
void VisitFields(const ClientPriority*, Visit visit) {
  visit(Field<&ClientPriority::from>{.help = "an address or a network", .fallback = kRequired});
  visit(Field<&ClientPriority::priority>{.help = "priority of the client's requests",
                                         .fallback = kRequired});
}

/// The priority of some functions; it takes precedence over the priorities of client and listener.
struct FunctionPriority {
  std::vector<std::uint8_t> codes;
  Priority priority = Priority::normal;
};

template <typename Visit>
void VisitFields(const FunctionPriority*, Visit visit) {
  visit(Field<&FunctionPriority::codes>{.help = "function codes: [5, 6, 15, 16]",
                                        .fallback = kRequired});
  visit(Field<&FunctionPriority::priority>{
      .help =
          "priority of these functions, in place of the priority of the client and the listener",
      .fallback = kRequired});
}

/// One permission of a role. A request is permitted if it fits all lists that are not empty.
struct RoleRule {
  struct Range {
    std::uint16_t first = 0;
    std::uint16_t last = 0;

    bool operator==(const Range&) const = default;
  };
  std::vector<Range> units;
  std::vector<std::uint8_t> functions;
  /// All registers or bits of the request must be in one of the ranges.
  std::vector<Range> addresses;

  bool operator==(const RoleRule&) const = default;
};

/// The rights of clients whose certificate contains this role (MB-TCP-Security v36, R-21).
struct RoleRights {
  std::string role;
  Permit permit = Permit::read;  ///< the rights, if `rules` is empty
  std::vector<RoleRule> rules{};

  bool operator==(const RoleRights&) const = default;
};

/// A port for Modbus masters: a TCP port, or a serial port with one master.
struct Listener {
  enum class Protocol : std::uint8_t {
    tcp,
    tls,  ///< Modbus/TCP Security: the client and the gateway show their certificates
  };
  enum class Errors : std::uint8_t {
    exception,  ///< exceptions 0x0A, 0x0B and 0x06 are sent
    silent,     ///< no reply is sent instead of these exceptions
  };
  /// The treatment of a write to unit 0 that no route names.
  enum class Broadcast : std::uint8_t {
    /// The write counts as a write to the gateway, which has nothing to write: exception 0x02.
    ignore,
    pass,  ///< the write is sent to all slaves of every line that has a route; never answered
  };
  /// The reply to a read of several registers if some of them belong to no point.
  enum class Holes : std::uint8_t {
    off,
    zero,  ///< 0, if the block contains at least one point
  };
  /// strip: the adapter at the serial port returns the gateway's own replies, and the gateway
  /// removes them.
  enum class Echo : std::uint8_t { off, strip };
  std::string host = "127.0.0.1";
  std::uint16_t port = 1502;
  std::string path;  ///< the serial port; if set, host and port are unused
  SerialSettings serial;
  Echo echo = Echo::off;
  modbus::Framing framing = modbus::Framing::tcp;  ///< at a serial port: rtu or ascii
  std::vector<Network> allow;                      ///< empty: everybody
  Permit permit = Permit::all;
  Protocol protocol = Protocol::tcp;
  TlsFiles tls;                   ///< for Protocol::tls: all three files
  std::vector<RoleRights> roles;  ///< for Protocol::tls; a client without one of them is refused
  Priority priority = Priority::normal;
  std::vector<ClientPriority> clients;
  std::vector<FunctionPriority> functions;
  Errors errors = Errors::exception;  ///< the loader sets silent for serial ports
  Broadcast broadcast = Broadcast::ignore;
  Holes holes = Holes::off;
  int max_clients = 256;
  Duration idle_timeout = std::chrono::minutes(5);
  Mark mark;

  bool is_serial() const { return !path.empty(); }
  /// True if messages are framed as on a serial line. Replies then contain no request number, so
  /// only one request is open at a time.
  bool speaks_serial() const { return framing != modbus::Framing::tcp; }
  /// Returns "0.0.0.0:502", "[::1]:502" or "/dev/ttyS1".
  std::string Address() const;
};

template <typename Visit>
void VisitFields(const Listener*, Visit visit) {
  visit(Key{"at", "\"0.0.0.0:502\", \"[::]:502\", or a serial port", {}, "127.0.0.1:1502"});
  visit(Field<&Listener::host>());
  visit(Field<&Listener::port>());
  visit(Field<&Listener::path>());
  visit(Field<&Listener::serial>{
      .help = "serial port only: serial settings, as at a line; also the keys parity and rs485",
      .fallback = "the usual settings of the framing"});
  visit(Field<&Listener::echo>{
      .help = "serial port only: strip if the adapter returns the gateway's own replies"});
  visit(Field<&Listener::framing>{.help = "rtu, ascii: the frames of a serial line, also over TCP",
                                  .fallback = "tcp; at a serial port rtu"});
  visit(Field<&Listener::protocol>{
      .help = "tls: Modbus/TCP Security, usually at port 802; needs certificate, key and ca"});
  visit(Field<&Listener::tls>{.key = "certificate",
                              .help = "tls only: file with the gateway's certificate and its chain",
                              .fallback = "required with tls"});
  visit(Key{"key",
            "tls only: file with the key of the certificate, mode 0640 or less",
            {},
            "required with tls"});
  visit(Key{"ca",
            "tls only: file with the authorities that issue the clients' certificates",
            {},
            "required with tls"});
  visit(Field<&Listener::roles>{
      .help = "tls only: rights of the roles in the clients' certificates; see modbus.md",
      .fallback = "viewer: read, operator: write, engineer: write"});
  visit(Field<&Listener::allow>{.help = "networks whose clients may connect; the word everybody "
                                        "permits all clients without a warning",
                                .fallback = "everybody"});
  visit(Key{"permit", "read: functions 1-4; data: 1-6, 15 and 16", "read, data, all", "all"});
  visit(Key{"write", "deny means permit: read", "allow, deny", "allow"});
  visit(Field<&Listener::permit>{"write"});
  visit(Field<&Listener::priority>{
      .help = "priority of the listener's requests on lines with a route"});
  visit(Field<&Listener::clients>{.help = "priorities of some clients: a list of maps, below"});
  visit(Field<&Listener::functions>{.help = "priorities of some functions: a list of maps, below"});
  visit(Field<&Listener::errors>{
      .help = "silent: no reply instead of the exceptions 0x06, 0x0A and 0x0B",
      .fallback = "exception; at a serial port silent"});
  visit(Field<&Listener::broadcast>{
      .help = "pass: a write to unit 0 goes to all slaves of lines with a route"});
  visit(Field<&Listener::holes>{
      .help = "zero: addresses without a point return 0 (their quality too) if the "
              "request contains at least one point; off: exception 0x02"});
  visit(Field<&Listener::max_clients>{
      "max_clients", "clients at the same time; fewer if the limit of open files is low", 1,
      10'000});
  visit(Field<&Listener::idle_timeout>{
      "idle_timeout", "a client that sends no request for this time is disconnected", 1s, 24h});
  visit(Derived<&Listener::mark>());
}

/// Forwards requests for some units unchanged to a line, or to another Modbus TCP server. Units of
/// devices take precedence, then the first route that names the unit.
struct Route {
  std::uint8_t first = 1;  ///< the first unit id, 0…255
  std::uint8_t last = 1;
  std::string line;  ///< name of a line whose protocol carries Modbus; empty: `host` is used
  std::size_t line_index = 0;  ///< index into Config::lines, if `line` is not empty
  std::string host;            ///< the server, if `line` is empty
  std::uint16_t port = 502;
  TlsFiles tls;  ///< `authorities` is not empty: the server is called over TLS
  /// `first` is mapped to this address, the next unit to the next address.
  std::optional<std::uint8_t> remap;
  /// The maximum time from the arrival of a request to the end of its reply, including queueing. A
  /// request that is still queued then is not sent.
  Duration deadline = std::chrono::milliseconds(2500);
  /// Settings for alarms of the units behind the route; take precedence over line and gateway.
  AlarmSetting alarms;
  Mark mark;

  bool Covers(std::uint8_t unit) const { return unit >= first && unit <= last; }
  /// Returns the address on the line, or the unit id at the server.
  std::uint8_t SlaveOf(std::uint8_t unit) const;
  std::string Units() const;
  /// Returns "line drive" or "server 10.0.0.9:502".
  std::string Target() const;
};

template <typename Visit>
void VisitFields(const Route*, Visit visit) {
  visit(Field<&Route::first>{.key = "units", .help = "20, or \"33-40\"", .fallback = kRequired});
  visit(Field<&Route::last>{"units"});
  visit(Field<&Route::line>{.help = "a line whose protocol carries Modbus"});
  visit(Derived<&Route::line_index>());
  visit(Key{"server", "in place of line: a Modbus TCP server, 10.0.0.9:502 or tls://10.0.0.9:802"});
  visit(Field<&Route::host>());
  visit(Field<&Route::port>());
  visit(Field<&Route::tls>{.key = "ca",
                           .help = "tls:// only: file with the authority of the server",
                           .fallback = "required with tls://"});
  visit(Key{
      "certificate", "tls:// only: file with the certificate that the gateway shows", {}, "none"});
  visit(Key{"key", "tls:// only: file with the key of the certificate", {}, "none"});
  visit(Field<&Route::remap>{
      "remap", "slave number of the first unit; the following units get the following numbers", 0,
      255, "the unit's own number"});
  visit(Field<&Route::deadline>{
      "deadline", "time from the request to the end of its reply, including the queue", 50ms,
      1min});
  visit(Field<&Route::alarms>{.help = "alarms of units that do not answer, below",
                              .fallback = "the line's, or the gateway's"});
  visit(Derived<&Route::mark>());
}

// DdsSecurity contains the files with which a DDS participant authenticates itself and others (DDS
// Security 1.1).

/// All paths are absolute. Without `identity` DDS is open to everybody who can reach its ports.
struct DdsSecurity {
  std::string ca;
  std::string permissions_ca;  ///< empty: the file of `ca`
  std::string identity;
  std::string key;
  std::string password_file;  ///< empty: the key has no password
  std::string governance;
  std::string permissions;
  Keys keys;

  bool on() const { return !identity.empty(); }
  const std::string& signer() const { return permissions_ca.empty() ? ca : permissions_ca; }
};

template <typename Visit>
void VisitFields(const DdsSecurity*, Visit visit) {
  visit(Field<&DdsSecurity::ca>{.help = "certificates of the authority that issues identities",
                                .fallback = kRequired});
  visit(Field<&DdsSecurity::permissions_ca>{
      .help = "certificate of the authority that signs governance and permissions",
      .fallback = "ca"});
  visit(Field<&DdsSecurity::identity>{.help = "the gateway's certificate", .fallback = kRequired});
  visit(Field<&DdsSecurity::key>{.help = "the gateway's private key", .fallback = kRequired});
  visit(Field<&DdsSecurity::password_file>{.help = "file with the password of the private key"});
  visit(Field<&DdsSecurity::governance>{.help = "signed file: what is protected in the domain",
                                        .fallback = kRequired});
  visit(Field<&DdsSecurity::permissions>{
      .help = "signed file: who may publish and subscribe which topics", .fallback = kRequired});
  visit(Derived<&DdsSecurity::keys>());
}

/// Returns the paths of the five files that `baudgate certs dds` creates in `directory`.
inline DdsSecurity SecurityIn(const std::string& directory) {
  DdsSecurity security;
  security.ca = directory + "/ca.pem";
  security.identity = directory + "/identity.pem";
  security.key = directory + "/key.pem";
  security.governance = directory + "/governance.p7s";
  security.permissions = directory + "/permissions.p7s";
  return security;
}

// Users contains the path of the users file (gateway/outputs/users/user_file.h).
struct Users {
  static constexpr bool kReloads = true;

  std::string file;  ///< empty: the gateway has no users
  Mark mark;
};

template <typename Visit>
void VisitFields(const Users*, Visit visit) {
  visit(Field<&Users::file>{.help = "file of users, roles and tokens; `baudgate users` makes it",
                            .fallback = "no users"});
  visit(Derived<&Users::mark>());
}

/// systemd's variable of the folder with a service's credentials (systemd.exec(5)), and a slash.
inline constexpr std::string_view kCredentials = "$CREDENTIALS_DIRECTORY/";

// Web contains the settings of the web page, its JSON and its metrics (gateway/outputs/web).
struct Web {
  static constexpr bool kReloads = true;

  bool on = false;  ///< true: the key `web` is present
  HostPort listen{"127.0.0.1", 8502};
  std::vector<Network> allow;      ///< networks that are allowed to connect; empty: everybody
  std::vector<std::string> hosts;  ///< the gateway's host names for browsers, in lower case
  /// File of the token; empty: there is none. A name behind kCredentials is a credential of
  /// systemd (LoadCredential=).
  std::string token_file;
  bool acknowledge = false;      ///< true: clients are allowed to acknowledge alarms
  std::vector<Network> proxies;  ///< proxies whose X-Forwarded-For is trusted
  TlsFiles tls;                  ///< `authorities` is empty: clients need no certificate
  Mark token_mark;
  Mark certificate_mark;

  std::string Address() const;
  bool on_loopback() const { return IsLoopback(ReachOf(listen.host)); }
};

template <typename Visit>
void VisitFields(const Web*, Visit visit) {
  visit(Field<&Web::on>{"web"});
  visit(Field<&Web::listen>{
      .help = "address of the page; any address other than 127.0.0.1 needs token"});
  visit(Field<&Web::allow>{.help = "addresses and networks that may connect",
                           .fallback = "everybody"});
  visit(Field<&Web::hosts>{.help = "names of this gateway in browsers: [gate.example.com]"});
  visit(Field<&Web::token_file>{.key = "token",
                                .help =
                                    "{ file: PATH }, mode 0600: its first line is the token; or "
                                    "{ credential: NAME } of systemd"});
  visit(Field<&Web::acknowledge>{.help = "whether alarms may be acknowledged on the page",
                                 .words = kDenyAllow});
  visit(Field<&Web::proxies>{
      .help = "addresses of proxies whose X-Forwarded-For and X-Forwarded-Proto are trusted",
      .fallback = "none"});
  visit(Field<&Web::tls>{.key = "certificate",
                         .help = "file: the certificate for TLS (https), with its chain",
                         .fallback = "no TLS"});
  visit(Key{"key", "file: the key of the certificate, mode 0640 or less"});
  visit(Key{"client_ca",
            "file: only clients with a certificate of this authority may connect",
            {},
            "every client"});
  visit(Derived<&Web::token_mark>());
  visit(Derived<&Web::certificate_mark>());
}

// Mqtt contains the settings of the client that publishes at an MQTT broker (gateway/outputs/mqtt).
struct MqttBroker {
  HostPort at;
  bool tls = false;

  bool operator==(const MqttBroker&) const = default;
  /// Returns "mqtt://10.0.0.9:1883" or "mqtts://broker.example:8883".
  std::string Address() const;
};

inline constexpr std::string_view kMqttScheme = "mqtt://";
inline constexpr std::string_view kMqttsScheme = "mqtts://";

struct Mqtt {
  static constexpr bool kReloads = false;

  enum class Payload : std::uint8_t { json, value, sparkplug };
  enum class Values : std::uint8_t {
    all,      ///< every point is published live
    history,  ///< only the points that the history stores
  };

  bool on = false;                  ///< true: the key `mqtt` is present
  std::vector<MqttBroker> brokers;  ///< tried in this order; at least one
  std::string user;
  std::string password_file;  ///< empty: no password
  TlsFiles tls;
  std::string client;  ///< empty: "baudgate-" and the name of the gateway
  std::string prefix = "baudgate";
  std::string topic = "{prefix}/{gateway}/{line}/{device}/{point}";
  Payload payload = Payload::json;
  std::string primary_host;  ///< empty: none
  Values values = Values::all;
  bool homeassistant = false;
  bool commands = false;
  Mark mark;
  Mark password_mark;
};

template <typename Visit>
void VisitFields(const Mqtt*, Visit visit) {
  visit(Field<&Mqtt::on>{"mqtt"});
  visit(Field<&Mqtt::brokers>{
      .key = "broker",
      .help = "mqtt://HOST:1883 or mqtts://HOST:8883; or a list, tried in this order",
      .fallback = kRequired});
  visit(Field<&Mqtt::user>{.help = "user name at the broker"});
  visit(Field<&Mqtt::password_file>{.key = "password",
                                    .help = "{ file: PATH }, mode 0600: its first line is the "
                                            "password"});
  visit(Field<&Mqtt::tls>{.key = "ca",
                          .help = "mqtts:// only: file with the authority of the broker",
                          .fallback = "required with mqtts://"});
  visit(Key{"certificate",
            "mqtts:// only: file with the certificate that the gateway shows",
            {},
            "none"});
  visit(Key{"key", "mqtts:// only: file with the key of the certificate", {}, "none"});
  visit(Field<&Mqtt::client>{.help = "client id; each gateway at a broker needs its own",
                             .fallback = "baudgate-NAME"});
  visit(Field<&Mqtt::prefix>{
      .help = "begin of all topics; with payload: sparkplug the group of the edge node"});
  visit(Field<&Mqtt::topic>{
      .help = "pattern of a point's topic, from {prefix}, {gateway}, {line}, {device}, {point}"});
  visit(Field<&Mqtt::payload>{
      .help = "json: value, quality and time; value: only the value; sparkplug: Sparkplug B"});
  visit(Field<&Mqtt::primary_host>{
      .help = "sparkplug only: host that must be online; else the backlog waits",
      .fallback = "none"});
  visit(Field<&Mqtt::values>{
      .help = "points that are published live: all, or those that the history stores"});
  visit(Field<&Mqtt::homeassistant>{.help = "true: Home Assistant discovers the points"});
  visit(Field<&Mqtt::commands>{.help = "whether clients of the broker may write points that "
                                       "devices allow",
                               .words = kDenyAllow});
  visit(Derived<&Mqtt::mark>());
  visit(Derived<&Mqtt::password_mark>());
}

/// The sending of stored values to a time-series database (gateway/outputs/remote_write).
struct RemoteWrite {
  static constexpr bool kReloads = true;

  /// A label of all series.
  struct Label {
    std::string name;
    std::string value;

    bool operator==(const Label&) const = default;
  };
  bool on = false;  ///< true: the key `remote_write` is present
  std::string url;
  std::vector<Label> labels;
  std::string user;           ///< empty: requests have no user
  std::string password_file;  ///< with `user` only
  std::string ca;             ///< for https; empty: the authorities that this machine trusts
  Mark mark;
  Mark password_mark;
};

template <typename Visit>
void VisitFields(const RemoteWrite*, Visit visit) {
  visit(Field<&RemoteWrite::on>{"remote_write"});
  visit(Field<&RemoteWrite::url>{
      .help = "where the receiver takes remote write: https://tsdb.example/api/v1/write",
      .fallback = kRequired});
  visit(Field<&RemoteWrite::labels>{.help = "labels of all series: { site: north }",
                                    .fallback = "none"});
  visit(Field<&RemoteWrite::user>{.help = "user name at the receiver (basic authentication)",
                                  .fallback = "none"});
  visit(Field<&RemoteWrite::password_file>{
      .key = "password",
      .help = "with user: { file: PATH }, mode 0600: its first line is the password"});
  visit(Field<&RemoteWrite::ca>{.help = "https only: file with the authority of the receiver",
                                .fallback = "the authorities of this machine"});
  visit(Derived<&RemoteWrite::mark>());
  visit(Derived<&RemoteWrite::password_mark>());
}

struct Modbus {
  bool enabled = true;
  std::vector<Listener> listen;
  std::vector<Route> routes;  ///< the first route that matches applies
};

template <typename Visit>
void VisitFields(const Modbus*, Visit visit) {
  visit(Field<&Modbus::enabled>{.help = "false: Modbus is off"});
  visit(Field<&Modbus::listen>{.help = "an address, a map, or a list of them",
                               .fallback = "127.0.0.1:1502"});
  visit(Field<&Modbus::routes>{.help = "a list; the first route that contains the unit is used"});
}

inline constexpr std::size_t kMostPeers = 64;

inline constexpr Duration kUsualLease = std::chrono::seconds(10);
inline constexpr Duration kShortestLease = std::chrono::seconds(2);
inline constexpr Duration kLongestLease = std::chrono::minutes(1);

struct Dds {
  static constexpr bool kReloads = false;

  bool enabled = true;
  int domain = 0;
  std::vector<std::string> interfaces = {"127.0.0.1"};
  bool multicast = true;  ///< true: discovery uses the domain's multicast group
  /// IPv4 addresses to which discovery messages are sent in addition to multicast; at most
  /// kMostPeers.
  std::vector<std::string> peers;
  /// IPv4 addresses of servers that introduce participants to each other.
  std::vector<HostPort> discovery_servers;
  Duration heartbeat = std::chrono::seconds(10);
  Duration lease = kUsualLease;
  DdsSecurity security;
  bool write = false;
};

template <typename Visit>
void VisitFields(const Dds*, Visit visit) {
  visit(Field<&Dds::enabled>{.help = "false: nothing is published"});
  visit(Field<&Dds::domain>{"domain", "DDS domain; above 232 its ports would be above 65535", 0,
                            232});
  visit(Field<&Dds::interfaces>{.help = "addresses of this machine that DDS uses"});
  visit(Field<&Dds::multicast>{.help = "false: contact peers and discovery servers only"});
  visit(Field<&Dds::peers>{.help = "machines to contact where multicast does not reach"});
  visit(Field<&Dds::discovery_servers>{
      .help = "discovery servers that connect this gateway with all others: [\"10.0.0.7:11811\"]"});
  visit(Field<&Dds::heartbeat>{"heartbeat", "every point is published at least this often", 100ms,
                               1h});
  visit(Field<&Dds::lease>{"lease", "a gateway that sends nothing for this time counts as lost",
                           kShortestLease, kLongestLease});
  visit(Field<&Dds::security>{.help = "a folder made by `baudgate certs dds`, or a map, below"});
  visit(
      Field<&Dds::write>{.help = "whether DDS participants may write the points that devices allow",
                         .words = kDenyAllow});
}

}  // namespace baudgate::config
