// `PointRequests` handles the requests `read`, `write` and `may_write` for points of one device.
// `read` and `write` are answered when the device has been asked (docs/status-reference.md).
//
//   {"command":"write","target":"bay-1.feeder-1.setting_group","value":"2"}
//   {"end":"ok","reason":"","read_back":true}
//
//   {"command":"write","target":"bay-1.feeder-1.setting_group","value":"2","client":"night",
//    "seq":7}
//   a request with the same client and seq gets the same "end" again; nothing is written twice
//
//   {"command":"may_write","target":"bay-1.feeder-1.setting_group","value":"9"}
//   {"may_write":false,"reason":"'setting_group': 9 is above the maximum, 1"}
//
//   {"command":"read","target":"bay-1.feeder-1"}
//   {"read":true,"reason":"","points":[{"point":"current_l1","value":0.52,"unit":"xIn",
//   …,"fresh":true}]}
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/bus/writes/request_book.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

class PointRequests {
 public:
  /// Takes the answer of a request. It is called once, on any thread.
  using Answered = std::function<void(status::Json)>;

  /// The references must outlive this object and all its requests.
  PointRequests(const bus::PointStore& store, bus::CommandSink& sink, bus::RequestBook::Past past)
      : store_(store), sink_(sink), gate_(store, sink), book_(std::move(past)) {}

  /// Starts a write. Members of `request`: `target`: LINE.DEVICE.POINT; `value` in the point's
  /// unit; `confirm` true: the point need not be selected before; `client` and `seq`: see
  /// RequestId; `expect`: the value that the person has seen (empty: none). If the point has
  /// another value directly before the write is sent, the write is denied. If Write returns an
  /// error (one sentence), `answered` is not called.
  Status Write(const config::Config& config, const status::Json& request, const bus::Writer& writer,
               Instant now, Answered answered);
  /// Returns whether permission, limits and interlocks would allow a write with `confirm` now.
  /// Sends and records nothing.
  Result<status::Json> MayWrite(const config::Config& config, const status::Json& request,
                                Instant now) const;
  /// Starts a read of `target`: LINE.DEVICE or LINE.DEVICE.POINT. If Read returns an error (one
  /// sentence), `answered` is not called.
  Status Read(const config::Config& config, const status::Json& request, const bus::Writer& writer,
              Now now, Answered answered);

  void Forget(const bus::Writer& writer) { gate_.Forget(writer); }

 private:
  /// Returns the point and the value that `request` names; the caller sets the other members.
  Result<bus::WriteAsk> AskOf(const config::Config& config, const status::Json& request) const;

  /// Registers `answered` for the request `id`. True if the request is new and has to be carried
  /// out; false if it is repeated and gets the answer of the first request.
  bool IsFresh(const bus::RequestId& id, Instant now, Answered answered);
  void Finish(const std::optional<bus::RequestId>& id, const Answered& answered,
              const WriteResult& result, const status::Json& answer);

  const bus::PointStore& store_;
  bus::CommandSink& sink_;
  bus::WriteGate gate_;
  Mutex mutex_;
  bus::RequestBook book_ BAUDGATE_GUARDED_BY(mutex_);
  /// Callbacks that wait for the answer to a request with an id. A repeated request has one entry
  /// for each time it was received.
  std::vector<std::pair<bus::RequestId, Answered>> waiting_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::control
