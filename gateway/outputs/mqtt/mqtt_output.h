// `MqttOutput` is the MQTT output of the gateway: a session on a thread of its own, and the
// forwarder of stored values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/worker.h"
#include "gateway/outputs/mqtt/session.h"
#include "gateway/outputs/outlet/outlet.h"
#include "gateway/outputs/outlet/report.h"
#include "gateway/outputs/output.h"

namespace baudgate::mqtt {

class MqttOutput final : public outputs::Output {
 public:
  /// All references must stay valid for the lifetime of the output.
  struct Links {
    bus::PointStore& store;
    bus::CommandSink& sink;
    std::shared_ptr<events::EventFeed> feed{};
    std::shared_ptr<events::CursorBook> cursors{};
    bool keeps_events = false;
    std::filesystem::path state{};  ///< the state folder; empty: `why_no_state`
    std::string why_no_state{};
    outlet::TellAlarms alarms{};
  };
  explicit MqttOutput(Links links) : links_(std::move(links)) {}
  ~MqttOutput() override { MqttOutput::Stop(); }
  static outputs::DescriptorNeeds Descriptors(const config::Config& config) {
    return {.others = config.mqtt.on ? std::size_t(8) : 0};
  }
  /// Returns the name under which the last confirmed event is stored (OutputRow::consumer); empty:
  /// MQTT is off.
  static std::string Consumer(const config::Config& config) {
    return config.mqtt.on ? Session::kConsumer : "";
  }

  std::string_view name() const override { return "mqtt"; }
  Status Open(const Configuration& config) override;
  Status Begin(const Configuration& config) override;
  std::vector<std::string> Apply(const Configuration& config,
                                 std::unique_ptr<Prepared> prepared) override;
  void SetHistory(const Configuration& config,
                  const std::shared_ptr<const history::HistorySource>& history) override;
  void StopRequests() override;
  /// Publishes `offline`, which takes up to about two seconds. A broker or a name service that does
  /// not answer is not waited for.
  void Stop() override;
  std::string Summary() override;
  std::optional<Json> Section(const Wish& wish) const override;
  std::vector<outputs::Series> Metrics() const override;

 private:
  const Links links_;
  std::string broker_;
  // Any thread uses the next two members, so they stay from Open to the end. The thread can outlive
  // this object while it waits for the name service.
  std::shared_ptr<Session> session_;
  std::unique_ptr<outlet::Forwarder> forwarder_;
  std::unique_ptr<Worker> worker_;
  std::shared_ptr<std::atomic<bool>> ended_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace baudgate::mqtt
