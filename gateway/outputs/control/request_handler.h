// `RequestHandler` answers the control socket: one request line in, one answer line out. It uses no
// sockets; gateway/outputs/control/control_server.h transports the lines. RecordReader answers
// requests that read the disk.
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

/// {"record":"…"}
std::string RecordLine(const records::TraceRecord& record);
bool Wanted(const TraceWish& wish, const records::TraceRecord& record);

// A command: its members and the function that answers it (docs/status-reference.md).

/// A member of a request besides "command".
struct Member {
  enum class Type : std::uint8_t { text, flag, whole, two_wholes };
  std::string_view name;
  Type type = Type::text;
};

struct Command {
  std::string_view name;
  std::vector<Member> members;
  Reply (*answer)(const Gateway& gateway, const Request& request);
  bool reads_disk = false;  ///< the answer may take as long as the disk
};

/// In the order in which they are listed for people.
const std::vector<Command>& Commands();

// Answers requests that read the disk, on a thread of its own: a hanging disk does not delay other
// requests.
class RecordReader {
 public:
  /// The most requests that wait.
  static constexpr std::size_t kMost = 16;

  RecordReader();

  /// `later` gets the answer, on the reader's thread. If too many requests wait, the Reply is an
  /// error.
  Reply Ask(const Command& command, std::shared_ptr<const Gateway> gateway, status::Json request,
            bus::Writer client, Now now, std::function<void(std::string text)> later);
  /// Waits for the answer that is being read; queued requests get none.
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
  /// All references must outlive this object; what `info` refers to, until the first reload.
  RequestHandler(const config::Config& config, const bus::PointStore& store,
                 lines::LineControl& control, bus::CommandSink& sink, status::GatewayInfo info);

  /// Takes an answer that does not come at once; on any thread.
  using Later = std::function<void(std::string text)>;
  Reply Answer(std::string_view request, const bus::Writer& client, Now now, const Later& later);
  void Forget(const bus::Writer& client) { points_.Forget(client); }
  lines::LineControl& control() { return gateway()->control; }
  /// Enables `reload` and `confirm`. `service` must outlive this object. To be called before the
  /// first request.
  void SetReload(ReloadService& service);
  /// From now on, another thread answers the commands that read the disk, until StopReading.
  void ReadApart();
  void StopReading() {
    if (reader_) reader_->Stop();
  }
  /// After a reload; indices are those of the store. Any thread may call it; it does not wait for
  /// requests.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history);
  /// Any thread may call it.
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
  std::unique_ptr<RecordReader> reader_;  // null: the calling thread reads the disk
};

}  // namespace baudgate::control
