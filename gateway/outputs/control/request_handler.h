// What the control socket answers: one request line in, one answer line out. Knows nothing of
// sockets; gateway/outputs/control/control_session.h carries the lines.
// gateway/outputs/control/commands.h has the commands.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "gateway/base/guarded.h"
#include "gateway/outputs/control/line_requests.h"
#include "gateway/outputs/control/record_reader.h"
#include "gateway/outputs/control/request.h"

namespace baudgate::control {

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
