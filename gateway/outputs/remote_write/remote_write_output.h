// `RemoteWriteOutput` sends the stored values to a time-series database, as an output of the
// gateway. A reload can start it, end it, or give it another receiver.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/outputs/outlet/outlet.h"
#include "gateway/outputs/outlet/report.h"
#include "gateway/outputs/output.h"
#include "gateway/outputs/remote_write/writer.h"

namespace baudgate::remote_write {

class RemoteWriteOutput final : public outputs::Output {
 public:
  struct Links {
    std::filesystem::path folder;  ///< the state folder; empty: `why_no_folder`
    std::string why_no_folder;
    /// Raises and ends the alarms of this output (records::EventPath::OnOutlet).
    outlet::TellAlarms alarms;
  };
  static outputs::DescriptorNeeds Descriptors(const config::Config& config) {
    // A connection, a lookup of its name, a file of the history, and the place with its log.
    return {.others = config.remote_write.on ? std::size_t{12} : 0};
  }
  explicit RemoteWriteOutput(Links links) : links_(std::move(links)) {}

  std::string_view name() const override { return "remote_write"; }
  Status Begin(const Configuration& config) override;
  std::vector<std::string> Apply(const Configuration& config,
                                 std::unique_ptr<Prepared> prepared) override;
  void SetHistory(const Configuration& config,
                  const std::shared_ptr<const history::HistorySource>& history) override;
  void Stop() override;
  std::string Summary() override;
  std::optional<Json> Section(const Wish& wish) const override;
  std::vector<outputs::Series> Metrics() const override;

 private:
  /// The forwarder is declared last, so it ends before its receiver.
  struct Running {
    explicit Running(const config::Config& config, const Links& links);
    const config::RemoteWrite settings;
    RemoteWriter writer;
    outlet::Forwarder forwarder;
  };

  const Links links_;
  std::shared_ptr<const history::HistorySource> history_;
  mutable Mutex mutex_;
  std::shared_ptr<Running> running_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::remote_write
