// `Session` decides what the gateway publishes and when. Its thread calls Round again and again.
// After each connection it publishes, in this order:
//
//   1. the present value of each point (retained), because a broker may have lost its messages
//   2. `online` (retained), so that `online` is true for the values as well
//   3. alarms, events after the last confirmed one, and stored values (gateway/outputs/outlet)
//
// With Sparkplug the births take the place of 1 and 2 (sparkplug_node.h). Meanwhile it empties the
// retained messages of points that no longer exist. Live values come before events, and events
// before stored values. The will is `offline`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/outputs/mqtt/client.h"
#include "gateway/outputs/mqtt/commands.h"
#include "gateway/outputs/mqtt/discovery.h"
#include "gateway/outputs/mqtt/live_points.h"
#include "gateway/outputs/mqtt/messages.h"
#include "gateway/outputs/mqtt/sparkplug_node.h"
#include "gateway/outputs/outlet/outlet.h"
#include "gateway/records/events/event_feed.h"

namespace baudgate::mqtt {

struct SessionState {
  Client::Phase phase = Client::Phase::waiting;
  std::string broker{};
  std::string trouble{};  ///< why there is no connection; empty: there is one
  std::string refused{};  ///< why the broker did not accept a message; empty: it accepted all
  std::string events_note{};
  std::uint64_t messages = 0;  ///< values that were published live
  std::uint64_t events = 0;    ///< events that the broker has confirmed
  std::uint64_t events_skipped = 0;
  std::uint64_t events_refused = 0;  ///< events that the broker will never accept
  std::uint64_t commands = 0;
  std::uint64_t times_lost = 0;
};

class Session final : public outlet::Receiver {
 public:
  /// The name of MQTT in the CursorBook.
  static constexpr char kConsumer[] = "mqtt";
  static constexpr Duration kTick = 100ms;       ///< changes are published at most this often
  static constexpr Duration kFarewell = 1500ms;  ///< the longest time that the last round takes

  struct Links {
    bus::PointStore& store;
    bus::CommandSink& sink;
    std::shared_ptr<events::EventFeed> feed{};  ///< null: no events and no alarms
    std::shared_ptr<events::CursorBook> cursors{};
    bool keeps_events = false;  ///< false: only alarms are published
    /// Called with true when the session is up, and with false when it has ended.
    std::function<void(bool)> connected{};
    Duration patience = Client::kPatience;
  };
  Session(const std::shared_ptr<const config::Config>& config, Links links);

  /// One round of work, about kTick. `last`: publishes `offline` and that no value is good any
  /// more, in at most kFarewell.
  Instant Round(bool last);

  // Any thread may call the functions below.

  /// Replaces the configuration after a reload.
  void Configure(std::shared_ptr<const config::Config> config);
  /// After StopCommands, no command reaches a line.
  void StopCommands();
  /// After Leave, the session calls nothing outside any more. To be called when its thread hangs.
  void Leave();
  bool is_blocked() const { return client_.is_blocked(); }
  SessionState state() const;
  void Send(outlet::Portion portion, std::function<void(outlet::Answer)> done) override;

 private:
  struct Mail {
    std::shared_ptr<const config::Config> config{};
    std::optional<outlet::Portion> portion{};
    std::function<void(outlet::Answer)> done{};
  };

  void TakeMail();
  void Reload(const std::shared_ptr<const config::Config>& config);
  void OnConnected();
  void OnLost();
  void OnMessage(const Message& message, Now now);
  void StartTidying();
  void Tidy(const Message& message);
  void EachEntity(std::uint32_t device, const std::function<void(const Entity&)>& visit) const;
  void Work(Now now);
  void SendAnswers();
  void SendValues(Now now);
  /// Publishes the messages for Home Assistant of as many devices as the network takes.
  void SendEntities();
  void SendOnline();
  void SendAlarms(Now now);
  void SendEvents();
  bool FindPlace();
  void SendPortion();
  void SendStored(const outlet::Portion& portion, std::function<void(outlet::Answer)> done);
  void EndEvents(const Delivery& delivery, std::int64_t seq);
  void Farewell();
  std::int64_t NextSeq(WallTime now);
  std::optional<bus::PointRef> Find(const std::string& topic) const;
  /// Returns a callback that notes a refusal of this topic.
  Delivered Noting(const std::string& topic);
  void Note(const std::string& topic, const Delivery& delivery);
  void Refused(const std::string& what, const std::string& why);
  void Show();

  std::shared_ptr<const config::Config> config_;
  const config::Mqtt settings_;
  Links links_;
  Topics topics_;
  std::unordered_map<std::size_t, bus::PointRef> by_topic_;  // key: hash of the topic
  std::unordered_map<std::string, std::string> units_;       // key: LINE.DEVICE.POINT
  LivePoints live_;
  Client client_;
  Commands commands_;
  std::optional<SparkplugNode> node_;         // with payload: sparkplug
  std::uint32_t next_entities_ = 0;           // device whose entities are to be published next
  std::unordered_set<std::size_t> entities_;  // hashes of the topics of all entities

  std::int64_t seq_ = 0;
  bool online_ = false;
  std::optional<Instant> tidy_until_;  // until then retained messages of old points are emptied
  std::map<events::AlarmKey, events::Alarm> alarms_;
  std::uint64_t alarms_version_ = 0;
  std::optional<Instant> alarms_due_;
  Instant alarms_sent_{};
  std::optional<std::int64_t> place_;  // number of the last event that was confirmed
  std::size_t events_open_ = 0;        // events that wait for a confirmation
  bool events_failed_ = false;
  Instant events_due_{};          // no events are sent before
  Instant online_due_{};          // `online` is repeated at this time
  bool stored_accepted_ = false;  // the broker has confirmed a stored value in this session
  std::string refused_;           // the subject of shown_.refused
  Mail open_;                     // the portion that is to be sent
  SessionState shown_;

  mutable Mutex mutex_;
  Mail mail_ BAUDGATE_GUARDED_BY(mutex_);
  SessionState state_ BAUDGATE_GUARDED_BY(mutex_);
  Mutex outside_;  // locked while a function outside is called
  bool left_ BAUDGATE_GUARDED_BY(outside_) = false;
};

}  // namespace baudgate::mqtt
