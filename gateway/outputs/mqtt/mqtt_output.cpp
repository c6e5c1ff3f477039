// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/mqtt_output.h"

#include <chrono>
#include <thread>

#include "gateway/base/log.h"

namespace baudgate::mqtt {
namespace {

constexpr outputs::Metric kConnected{"baudgate_mqtt_connected", "gauge",
                                     "1 while the broker is connected."};
constexpr outputs::Metric kValues{"baudgate_mqtt_values_total", "counter",
                                  "Values that were published live."};
constexpr outputs::Metric kEvents{"baudgate_mqtt_events_total", "counter",
                                  "Events that the broker has confirmed."};
constexpr outputs::Metric kLost{"baudgate_mqtt_connections_lost_total", "counter",
                                "Connections to the broker that have ended."};

constexpr outlet::MetricNames kStored = {"baudgate_mqtt_behind_seconds",
                                         "baudgate_mqtt_confirmed_total",
                                         "baudgate_mqtt_refused_total", "baudgate_mqtt_gaps_total"};

/// How long Stop waits for the last round of the session, beyond Session::kFarewell.
constexpr Duration kPatience = Session::kFarewell + 500ms;

const char* Name(Client::Phase phase) {
  switch (phase) {
    case Client::Phase::connecting:
      return "connecting";
    case Client::Phase::connected:
      return "connected";
    case Client::Phase::waiting:
      break;
  }
  return "waiting";
}

/// Keeps a session whose thread hangs until the process ends.
void KeepForEver(std::shared_ptr<Session> session) {
  static auto* const kept = new std::vector<std::shared_ptr<Session>>();
  kept->push_back(std::move(session));
}

}  // namespace

Status MqttOutput::Open(const Configuration& config) {
  if (!config->mqtt.on) return {};
  broker_ = config->mqtt.brokers.front().Address();
  Session::Links links{links_.store, links_.sink, links_.feed, links_.cursors, links_.keeps_events};
  links.connected = [this](bool connected) { forwarder_->SetConnected(connected); };
  session_ = std::make_shared<Session>(config, std::move(links));
  outlet::Forwarder::Options options;
  options.name = "mqtt";
  options.receiver = session_.get();
  options.folder = links_.state;
  options.why_no_folder = links_.why_no_state;
  options.connected = false;
  options.watch = [session = session_, alarms = links_.alarms](const outlet::ForwarderState& stored,
                                                               Now now) {
    if (!alarms) return;
    outlet::OutletAlarms its = outlet::AlarmsOf(stored, now.wall);
    const std::string trouble = session->state().trouble;
    if (!its.away.empty() && !trouble.empty()) its.away = trouble;
    alarms(its, now);
  };
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  forwarder_ = std::make_unique<outlet::Forwarder>(std::move(options));
  return {};
}

Status MqttOutput::Begin(const Configuration& /*config*/) {
  if (!session_) return {};
  worker_ = std::make_unique<Worker>("mqtt", [session = session_, ended = ended_](bool last) {
    const Instant next = session->Round(last);
    if (last) *ended = true;
    return next;
  });
  worker_->Start();
  return {};
}

std::vector<std::string> MqttOutput::Apply(const Configuration& config,
                                           std::unique_ptr<Prepared> /*prepared*/) {
  if (session_) session_->Configure(config);
  return {};
}

void MqttOutput::SetHistory(const Configuration& /*config*/,
                            const std::shared_ptr<const history::HistorySource>& history) {
  if (forwarder_) forwarder_->SetHistory(history);
}

void MqttOutput::StopRequests() {
  if (session_) session_->StopCommands();
}

void MqttOutput::Stop() {
  if (!worker_) return;
  StopRequests();
  worker_->RequestStop();
  const Instant end = ReadClocks().instant + kPatience;
  while (!*ended_ && ReadClocks().instant < end) std::this_thread::sleep_for(5ms);
  session_->Leave();
  if (*ended_) {
    worker_->Stop();
  } else {
    KeepForEver(session_);
    worker_->Leave();
  }
  worker_.reset();
  forwarder_->SetHistory(nullptr);
}

std::string MqttOutput::Summary() { return session_ ? "MQTT to " + broker_ : std::string(); }

std::optional<outputs::Output::Json> MqttOutput::Section(const Wish& /*wish*/) const {
  if (!session_) return Json(nullptr);
  const SessionState state = session_->state();
  Json json;
  json["broker"] = state.broker;
  json["state"] = Name(state.phase);
  json["values"] = state.messages;
  json["events"] = state.events;
  json["events_skipped"] = state.events_skipped;
  json["events_refused"] = state.events_refused;
  json["commands"] = state.commands;
  json["times_lost"] = state.times_lost;
  outlet::ForwarderState stored = forwarder_->state();
  // Without a connection, the session tells why values wait.
  if (state.phase != Client::Phase::connected) stored.trouble.clear();
  Json& advice = json["advice"] = Json::array();
  if (session_->is_blocked()) {
    advice.push_back("the name service has not found the broker " + state.broker + " yet");
  }
  for (const std::string& text : {state.trouble, state.refused, state.events_note}) {
    if (!text.empty()) advice.push_back(text);
  }
  json["stored"] = nullptr;
  if (stored.has_history) {
    Json section = outlet::SectionOf(stored);
    for (const Json& text : section["advice"]) advice.push_back(text);
    section.erase("advice");
    json["stored"] = std::move(section);
  }
  if (state.events_refused > 0) {
    advice.push_back(std::to_string(state.events_refused) + " events were refused by the broker");
  }
  if (state.events_skipped > 0) {
    advice.push_back(std::to_string(state.events_skipped) +
                     " events were deleted before the broker could receive them");
  }
  return json;
}

std::vector<outputs::Series> MqttOutput::Metrics() const {
  if (!session_) return {};
  const SessionState state = session_->state();
  std::vector<outputs::Series> series = {
      outputs::Series(kConnected, state.phase == Client::Phase::connected ? 1 : 0),
      outputs::Series(kValues, static_cast<double>(state.messages)),
      outputs::Series(kEvents, static_cast<double>(state.events)),
      outputs::Series(kLost, static_cast<double>(state.times_lost))};
  const outlet::ForwarderState stored = forwarder_->state();
  if (!stored.has_history) return series;
  for (outputs::Series& one : outlet::SeriesOf(kStored, stored)) series.push_back(std::move(one));
  return series;
}

}  // namespace baudgate::mqtt
