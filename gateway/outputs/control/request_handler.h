// What the control socket answers: one request line in, one answer line out. Knows nothing of
// sockets; gateway/outputs/control/control_server.h carries the lines.
// Commands() lists the commands. CheckShape checks the members of a request, and RecordReader
// answers requests that read the disk.
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

/// {"record":"…"}: a record of a trace as it travels.
std::string RecordLine(const records::TraceRecord& record);
bool Wanted(const TraceWish& wish, const records::TraceRecord& record);

// The commands of the control socket: one row each, with its fields and the part that answers it.
// docs/status.md describes them.

/// Besides "command".
struct Member {
  enum class Type : std::uint8_t { text, flag, whole, two_wholes };
  std::string_view name;
  Type type = Type::text;
};

struct Command {
  std::string_view name;
  std::vector<Member> members;
  Reply (*answer)(const Gateway& gateway, const Request& request);
  bool reads_disk = false;  ///< it answers at once, and as late as the disk does
};

/// In the order in which they are listed for people.
const std::vector<Command>& Commands();

// Answers requests that read the disk, on a thread of their own: a disk that hangs does not hold up
// other requests.
class RecordReader {
 public:
  /// So many requests wait at most.
  static constexpr std::size_t kMost = 16;

  RecordReader();

  /// `later` takes the answer, on the thread of this. Not ok: too many wait already.
  Reply Ask(const Command& command, std::shared_ptr<const Gateway> gateway, status::Json request,
            bus::Writer client, Now now, std::function<void(std::string text)> later);
  /// Waits for the answer that is being read; what waits is not answered.
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
  /// All references outlive the service. Until the first reload so does what `info` names.
  RequestHandler(const config::Config& config, const bus::PointStore& store,
                 lines::LineControl& control, bus::CommandSink& sink, status::GatewayInfo info);

  /// Takes an answer that did not come at once, on any thread.
  using Later = std::function<void(std::string text)>;
  Reply Answer(std::string_view request, const bus::Writer& client, Now now, const Later& later);
  void Forget(const bus::Writer& client) { points_.Forget(client); }
  lines::LineControl& control() { return gateway()->control; }
  /// It outlives this; without it nothing is reloaded. Before anything is asked.
  void SetReload(ReloadService& service);
  /// From now on commands that read the disk are answered by another thread, until StopReading.
  void ReadApart();
  void StopReading() {
    if (reader_) reader_->Stop();
  }
  /// A reload: what can be named, by the numbers of the store. From any thread; does not wait.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history);
  /// As it is now.
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
  std::unique_ptr<RecordReader> reader_;  // null: the disk is read at once
};

}  // namespace baudgate::control
