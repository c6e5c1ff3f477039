// `TrafficBook` contains the counters of clients, serial masters and routes from which
// TrafficStatus is filled. The server's thread counts; any thread may call Status.
// `FunctionCounters` and `LiveCounters` are the counters of functions and clients.
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

// `FunctionCounters` counts how often each function was used at a listener, and which exceptions
// were the answer. Only the server's thread counts, without a lock; any thread can read.
class FunctionCounters {
 public:
  /// Counts a request. `exception`: 0 for no exception; codes above 0x0B are counted as 0x0B.
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
  /// The functions of the standard, each with its own counter. All other functions share one
  /// counter.
  static constexpr std::array<std::uint8_t, 19> kFunctions = {
      1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43};
  static constexpr std::size_t kExceptions = 12;  // exception codes 0 to 0x0B

  static std::size_t PlaceOf(std::uint8_t function) {
    return static_cast<std::size_t>(std::ranges::find(kFunctions, function) - kFunctions.begin());
  }

  std::array<std::array<std::atomic<std::uint64_t>, kExceptions>, kFunctions.size() + 1>
      counters_{};
};

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
  /// Only one thread writes, so a locked instruction is not needed.
  static void Add(std::atomic<std::uint64_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
};

/// The counters of one client. Only the server's thread writes them, without a lock.
struct ClientRecord {
  std::uint64_t id = 0;
  std::string peer;
  std::string listener;
  std::shared_ptr<FunctionCounters> functions{};  // shared by all clients of the listener
  config::Priority priority = config::Priority::normal;
  WallTime since{};
  std::atomic<Instant> last_request = Instant::min();
  std::atomic<std::uint64_t> requests = 0;
  std::atomic<std::uint64_t> exceptions = 0;
  std::atomic<std::uint64_t> bytes_in = 0;
  std::atomic<std::uint64_t> bytes_out = 0;
  std::atomic<std::uint32_t> outstanding = 0;

  static void Add(std::atomic<std::uint64_t>& counter, std::uint64_t count = 1) {
    counter.store(counter.load(std::memory_order_relaxed) + count, std::memory_order_relaxed);
  }
};

/// The end of a routed request. Each value has its counter in RouteCounters.
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
  /// Used in place of a route's number for broadcasts that belong to no route. A broadcast is
  /// counted once for each line.
  static constexpr std::size_t kBroadcasts = std::numeric_limits<std::size_t>::max();

  TrafficBook();

  /// Sets the routes that Status returns. Requests of removed routes are counted, but not returned.
  void Show(const RouteList& routes);

  std::shared_ptr<ClientRecord> Enter(const std::string& peer, const config::Listener& listener,
                                      config::Priority priority, WallTime since);
  void Leave(const ClientRecord& client);

  /// Adds a serial port that waits for a master. Returns the port's number in the book.
  std::size_t AddMaster(const config::Listener& listener, WallTime since);
  void RemoveMaster(std::size_t master);
  void ShowClosed(std::vector<ClosedListener> closed);
  void ShowPort(std::size_t master, bool is_open, const std::string& text, WallTime at);
  void Heard(std::size_t master, WallTime at);
  void HeardDamage(std::size_t master);
  /// Must be called when damaged bytes were a request in another framing. False if the same framing
  /// has been reported since the last good frame.
  bool HeardOther(std::size_t master, Framing heard);
  void HeardOther(const std::string& listener, const std::string& peer, Framing heard,
                  Framing expected, WallTime at);
  /// Must be called when a master's port has received an echo of a reply although `echo` is off.
  void HeardEcho(std::size_t master);

  void Asked(std::size_t route, std::uint8_t unit);
  /// Counts the end of a request. `reply` is empty if there was no reply. `at` is needed only for
  /// no_reply, expired and busy.
  void Ended(std::size_t route, std::uint8_t unit, RouteOutcome end, const bus::RoutedReply& reply,
             WallTime at);

  /// Counts a reply that came after the deadline of its request.
  void CameLate(std::size_t route);

  TrafficStatus Status(const Now& now) const;

 private:
  RouteStatus& At(std::size_t route) BAUDGATE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<std::uint64_t, std::shared_ptr<ClientRecord>> clients_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<FunctionCounters>> functions_
      BAUDGATE_GUARDED_BY(mutex_);  // key: the listener's address
  std::uint64_t next_client_ BAUDGATE_GUARDED_BY(mutex_) = 1;
  std::map<std::size_t, MasterStatus> masters_ BAUDGATE_GUARDED_BY(mutex_);
  std::size_t next_master_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::vector<ClosedListener> closed_ BAUDGATE_GUARDED_BY(mutex_);
  // Key: the listener's address.
  std::map<std::string, OtherSpeaker> others_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<RouteStatus> routes_ BAUDGATE_GUARDED_BY(mutex_);  // by route number
  // The numbers of the routes in the running file.
  std::vector<std::size_t> shown_ BAUDGATE_GUARDED_BY(mutex_);
  RouteStatus broadcasts_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::modbus
