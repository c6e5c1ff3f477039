// Keeps the counters of clients, serial masters and routes behind TrafficStatus. They are reported
// on the server's thread by client_requests.cpp, router.cpp,
// gateway/outputs/modbus/serial/serial_listener.cpp and
// gateway/outputs/modbus/upstream/upstream.cpp; gateway/outputs/modbus/server/modbus_server.cpp
// hands the numbers out to any thread. FunctionCounters and LiveCounters are the counters of
// functions and clients.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/outputs/modbus/registers/register_contents.h"
#include "gateway/outputs/modbus/service/route_table.h"
#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::modbus {

// How often each function was asked at a listener, and how it was answered. The server's thread
// alone counts, without a lock; any thread reads.
class FunctionCounters {
 public:
  /// `exception`: 0 for none.
  void Add(std::uint8_t function, std::uint8_t exception = 0) {
    constexpr auto kRelaxed = std::memory_order_relaxed;
    auto& counter = counters_[PlaceOf(function)][std::min<std::size_t>(exception, kExceptions - 1)];
    counter.store(counter.load(kRelaxed) + 1, kRelaxed);
  }
  void AppendTo(const std::string& listener, std::vector<FunctionCount>& counts) const {
    for (std::size_t place = 0; place < counters_.size(); ++place) {
      const std::uint8_t function = place < kFunctions.size() ? kFunctions[place] : 0;
      for (std::uint8_t exception = 0; exception < kExceptions; ++exception) {
        const std::uint64_t count = counters_[place][exception].load(std::memory_order_relaxed);
        if (count > 0) counts.push_back({listener, function, exception, count});
      }
    }
  }

 private:
  /// Functions of the standard; all others are counted as one.
  static constexpr std::array<std::uint8_t, 19> kFunctions = {
      1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43};
  static constexpr std::size_t kExceptions = 12;  // 0x0B is the last

  static std::size_t PlaceOf(std::uint8_t function) {
    return static_cast<std::size_t>(std::ranges::find(kFunctions, function) - kFunctions.begin());
  }

  std::array<std::array<std::atomic<std::uint64_t>, kExceptions>, kFunctions.size() + 1>
      counters_{};
};

// What the clients of a Modbus server do, counted while it runs.
struct LiveCounters {
  std::atomic<std::uint64_t> clients = 0;
  std::atomic<std::uint64_t> accepted = 0;
  std::atomic<std::uint64_t> refused = 0;
  std::atomic<std::uint64_t> malformed = 0;
  std::atomic<std::uint64_t> idle = 0;
  std::atomic<std::uint64_t> stalled = 0;
  std::atomic<std::uint64_t> accept_errors = 0;
  std::atomic<std::uint64_t> requests = 0;
  std::atomic<std::uint64_t> exceptions = 0;

  ModbusCounters Snapshot() const;
  /// One thread writes, so no locked instruction is needed.
  static void Add(std::atomic<std::uint64_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
};

/// The numbers of one client. The server's thread alone writes them, without a lock.
struct ClientRecord {
  std::uint64_t id = 0;
  std::string peer;
  std::string listener;
  std::shared_ptr<FunctionCounters> functions{};  // of the listener
  config::Priority priority = config::Priority::normal;
  WallTime since{};
  std::atomic<Instant> last_request = Instant::min();
  std::atomic<std::uint64_t> requests = 0;
  std::atomic<std::uint64_t> exceptions = 0;
  std::atomic<std::uint64_t> bytes_in = 0;
  std::atomic<std::uint64_t> bytes_out = 0;
  std::atomic<std::uint32_t> outstanding = 0;

  /// One thread writes, so no locked instruction is needed.
  static void Add(std::atomic<std::uint64_t>& counter, std::uint64_t count = 1) {
    counter.store(counter.load(std::memory_order_relaxed) + count, std::memory_order_relaxed);
  }
};

/// How a routed request ended, as RouteCounters has it.
enum class RouteOutcome : std::uint8_t {
  ok,
  refused,
  no_reply,
  expired,
  busy,
  abandoned,
  broadcast,
  denied,
};

class TrafficBook {
 public:
  /// In place of a route's number: where broadcasts that no route names are counted, one per line.
  static constexpr std::size_t kBroadcasts = std::numeric_limits<std::size_t>::max();

  TrafficBook();

  /// These are shown from now on. What ends at others is still counted there.
  void Show(const RouteList& routes);

  std::shared_ptr<ClientRecord> Enter(const std::string& peer, const config::Listener& listener,
                                      config::Priority priority, WallTime since);
  void Leave(const ClientRecord& client);

  /// A serial port at which a master is awaited: its place in the book.
  std::size_t AddMaster(const config::Listener& listener, WallTime since);
  /// None is awaited there any more.
  void RemoveMaster(std::size_t master);
  /// In place of those before.
  void ShowClosed(std::vector<ClosedListener> closed);
  void ShowPort(std::size_t master, bool is_open, const std::string& text, WallTime at);
  void Heard(std::size_t master, WallTime at);
  void HeardDamage(std::size_t master);
  /// The damage before was a message in another framing. True: that is news.
  bool HeardOther(std::size_t master, Framing heard);
  /// The same of a TCP client.
  void HeardOther(const std::string& listener, const std::string& peer, Framing heard,
                  Framing expected, WallTime at);
  /// One of the gateway's own replies, where `echo` is off.
  void HeardEcho(std::size_t master);

  /// `route`: its number, or kBroadcasts.
  void Asked(std::size_t route, std::uint8_t unit);
  /// `reply` may be empty where there was none, and `at` where the client has left.
  void Ended(std::size_t route, std::uint8_t unit, RouteOutcome end, const bus::RoutedReply& reply,
             WallTime at);

  /// A reply for which no client waits any more.
  void CameLate(std::size_t route);

  /// From any thread.
  TrafficStatus Status(const Now& now) const;

 private:
  RouteStatus& At(std::size_t route) BAUDGATE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<std::uint64_t, std::shared_ptr<ClientRecord>> clients_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<FunctionCounters>> functions_
      BAUDGATE_GUARDED_BY(mutex_);  // by listener
  std::uint64_t next_client_ BAUDGATE_GUARDED_BY(mutex_) = 1;
  std::map<std::size_t, MasterStatus> masters_ BAUDGATE_GUARDED_BY(mutex_);
  std::size_t next_master_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::vector<ClosedListener> closed_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, OtherSpeaker> others_ BAUDGATE_GUARDED_BY(mutex_);  // by listener
  std::vector<RouteStatus> routes_ BAUDGATE_GUARDED_BY(mutex_);             // by number
  std::vector<std::size_t> shown_ BAUDGATE_GUARDED_BY(mutex_);              // their numbers
  RouteStatus broadcasts_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::modbus
