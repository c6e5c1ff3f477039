// `RemoteWriter` sends portions of values to a time-series database. A thread of its own waits for
// the network.
//
//   answer of the database        what follows (outlet::Answer)
//   2xx                           confirmed
//   400, 413, 422                 refused: the portion is split until the bad values are found
//   429, 5xx                      retry, after the time of Retry-After if there is one
//   3xx, other 4xx                retry: the address, the user or the receiver's settings are wrong
//   none                          retry
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/config.h"
#include "gateway/base/worker.h"
#include "gateway/outputs/outlet/outlet.h"
#include "gateway/outputs/remote_write/series.h"

namespace baudgate::remote_write {

/// The receiver's answer to a request. `status` 0: there was none, for the reason `text`.
struct HttpAnswer {
  long status = 0;
  std::string text{};
  std::optional<Duration> retry_after{};
};

/// Decides by the answer. `portion`: what was sent. A value that the receiver has already is not
/// refused: the answer to its first attempt was lost.
outlet::Answer Judge(const HttpAnswer& answer, const outlet::Portion& portion,
                     const std::string& url);

class RemoteWriter final : public outlet::Receiver {
 public:
  static constexpr Duration kConnectTimeout = 10s;
  static constexpr Duration kTimeout = 30s;
  /// After the receiver has refused a value as too old, values that are as old or older are not
  /// sent for this time.
  static constexpr Duration kTooOldFor = 10min;

  explicit RemoteWriter(config::RemoteWrite settings);
  /// Ends a request that is under way, and waits at most 2 s for its end.
  ~RemoteWriter() override;
  RemoteWriter(const RemoteWriter&) = delete;
  RemoteWriter& operator=(const RemoteWriter&) = delete;

  void SetNames(std::shared_ptr<const SeriesNames> names);
  void Send(outlet::Portion portion, std::function<void(outlet::Answer)> done) override;

 private:
  class Work;
  std::shared_ptr<Work> work_;
  Worker worker_;
};

}  // namespace baudgate::remote_write
