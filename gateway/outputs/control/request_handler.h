// `RequestHandler` answers the requests of the control socket: Answer takes one request line and
// returns one answer line. It uses no sockets; gateway/outputs/control/control_server.h transports
// the lines. RecordReader answers requests that read the disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/lines/line_control.h"
#include "gateway/outputs/control/request.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

/// Returns {"record":"…"}, the line that a trace sends for a record.
std::string RecordLine(const records::TraceRecord& record);
bool Wanted(const TraceWish& wish, const records::TraceRecord& record);

// Command: the name of a request, its members and the function that answers it
// (docs/status-reference.md).

struct Member {
  enum class Type : std::uint8_t { text, flag, whole, two_wholes, wholes };
  std::string_view name;
  Type type = Type::text;
};

struct Command {
  std::string_view name;
  Act act;
  std::vector<Member> members;
  Reply (*answer)(const Gateway& gateway, const Request& request);
  bool reads_disk = false;  ///< the request reads the disk, so its answer can take long
};

const std::vector<Command>& Commands();

// RecordReader answers requests that read the disk, on a thread of its own, so that a disk that
// hangs does not delay other requests.
class RecordReader {
 public:
  static constexpr std::size_t kMost = 16;

  RecordReader();

  /// Queues the request. `later` gets the answer, on the reader's thread. If the queue is full, the
  /// returned Reply contains an error.
  Reply Ask(const Command& command, std::shared_ptr<const Gateway> gateway, status::Json request,
            bus::Writer client, Now now, std::function<void(std::string text)> later);
  /// Waits until the request in progress is answered. Queued requests get no answer.
  void Stop() { worker_.Stop(); }

 private:
  struct Job {
    const Command* command;
    std::shared_ptr<const Gateway> gateway;
    status::Json request;
    bus::Writer client;
    Now now;
    std::function<void(std::string text)> later;
  };
  Instant Round(bool last);

  WorkQueue<Job> queue_{kMost};
  Worker worker_;
};

class RequestHandler {
 public:
  /// All references and all objects that `info` points to must outlive this object.
  RequestHandler(const config::Config& config, const bus::PointStore& store,
                 lines::LineControl& control, bus::CommandSink& sink, status::GatewayInfo info);

  /// Takes the answer of a request that is answered later, on any thread.
  using Later = std::function<void(std::string text)>;
  /// A request that the role of `client` does not permit is refused as `denied`.
  Reply Answer(std::string_view request, const bus::Writer& client, Now now, const Later& later);
  void Forget(const bus::Writer& client) { points_.Forget(client); }
  lines::LineControl& control() { return gateway()->control; }
  /// Enables `reload`, `confirm` and `revert`. To be called before the first request. `service`
  /// must outlive this object.
  void SetReload(ReloadService& service);
  /// Starts a thread that answers the commands with `reads_disk`, until StopReading.
  void ReadApart();
  void StopReading() {
    if (reader_) reader_->Stop();
  }
  /// Replaces the configuration after a reload; its indices are those of the point store. Any
  /// thread may call it. Requests that are being answered go on with the previous configuration.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history);
  std::shared_ptr<const Gateway> gateway() const {
    const MutexLock lock(mutex_);
    return gateway_;
  }

 private:
  template <typename Change>
  void Renew(Change change);

  PointRequests points_;
  mutable Mutex mutex_;
  std::shared_ptr<const Gateway> gateway_ BAUDGATE_GUARDED_BY(mutex_);
  // Null: requests that read the disk are answered on the calling thread.
  std::unique_ptr<RecordReader> reader_;
};

}  // namespace baudgate::control
