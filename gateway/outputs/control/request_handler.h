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

// Requests about lines and their devices: `status`, `settings`, `release`, `take_back`, `enable`,
// `disable`, `trace` and `recorded`. AskManually handles telegrams by hand.

// Requests of the control socket for telegrams by hand: completed and judged by the protocol of the
// line, allowed or denied, recorded where they may write, and sent in their turn.
//
//   {"command":"ask","target":"bay","telegram":"3E 31 52 46 3A"}
//   {"sent":"3E 31 52 46 3A 32 31 0D","received":"0A 3C …","outcome":"ok","reason":""}
//
// "sent" is empty, and "reason" says why, if nothing was sent.

/// `target`: LINE or LINE.DEVICE, whose protocol and options it has; `telegram` in hex, as it was
/// written; `write`: it may write. The error is one sentence; without one `answered` is called
/// once, on any thread. All references outlive what was asked.
Status AskManually(const config::Config& config, LineControl& control, CommandSink& sink,
                   const Json& request, const Writer& writer, Instant now,
                   const std::function<void(const Json&)>& answered);

/// The longest time that a port is lent; longer needs a second call.
inline constexpr Duration kMostRelease = 24h;

Reply ShowStatus(const Gateway& gateway, const Request& request);
Reply ShowSettings(const Gateway& gateway, const Request& request);
/// The port of a line is lent: to a program that opens it, or to clients of a TCP port.
Reply Release(const Gateway& gateway, const Request& request);
Reply TakeBack(const Gateway& gateway, const Request& request);
Reply Enable(const Gateway& gateway, const Request& request);
Reply Disable(const Gateway& gateway, const Request& request);
Reply Trace(const Gateway& gateway, const Request& request);
/// Shows the records in the flight recorder of a line.
Reply ShowRecorded(const Gateway& gateway, const Request& request);

/// {"record":"…"}: a record of a trace as it travels.
std::string RecordLine(const TraceRecord& record);
bool Wanted(const TraceWish& wish, const TraceRecord& record);

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

// Whether a request has the members of its command,
// with their types. A member that is misspelt or has another type is refused. It is never ignored.
//
//   {"command":"reload","dry_run":"yes"}   'dry_run' of 'reload' is true or false, and not "yes"
//   {"command":"release","for":"10m"}      'for' is no member of 'release'; …

Status CheckShape(const Command& command, const Json& request);

// Answers requests that read the disk, on a thread of their own: a disk that hangs does not hold up
// other requests.
class RecordReader {
 public:
  /// So many requests wait at most.
  static constexpr std::size_t kMost = 16;

  RecordReader();

  /// `later` takes the answer, on the thread of this. Not ok: too many wait already.
  Reply Ask(const Command& command, std::shared_ptr<const Gateway> gateway, Json request,
            Writer client, Now now, std::function<void(std::string text)> later);
  /// Waits for the answer that is being read; what waits is not answered.
  void Stop() { worker_.Stop(); }

 private:
  struct Job {
    const Command* command;
    std::shared_ptr<const Gateway> gateway;
    Json request;
    Writer client;
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
  RequestHandler(const config::Config& config, const PointStore& store, LineControl& control,
                 CommandSink& sink, GatewayInfo info);

  /// Takes an answer that did not come at once, on any thread.
  using Later = std::function<void(std::string text)>;
  Reply Answer(std::string_view request, const Writer& client, Now now, const Later& later);
  void Forget(const Writer& client) { points_.Forget(client); }
  LineControl& control() { return gateway()->control; }
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
