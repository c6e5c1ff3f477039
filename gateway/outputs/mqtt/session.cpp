// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/session.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/text.h"

namespace baudgate::mqtt {
namespace {

/// If the gateway has never published events, it begins with this many of the newest events.
constexpr std::int64_t kEventImage = 1000;
constexpr std::size_t kEventsAtATime = 100;
constexpr std::size_t kAlarmsAtATime = 1000;
constexpr Duration kAlarmPause = 1s;
/// How long the broker may take to send the retained messages of a new subscription.
constexpr Duration kTidyTime = 10s;
/// `online` is repeated, and the broker forgets it after the lifetime: if gateway and broker lose
/// their power together, no will is sent.
constexpr Duration kOnlineEvery = 15s;
constexpr std::uint32_t kOnlineLifetime = 45;  // seconds
/// How long events wait after the broker has not accepted some.
constexpr Duration kEventPause = 5s;

constexpr char kSet[] = "/set";

std::size_t TopicHash(std::string_view topic) { return std::hash<std::string_view>()(topic); }

}  // namespace

Session::Session(const std::shared_ptr<const config::Config>& config, Links links)
    : settings_(config->mqtt),
      links_(std::move(links)),
      topics_(*config),
      live_(links_.store),
      client_(settings_,
              {[this] {
                 return node_ ? node_->NextWill()
                              : Client::Will{topics_.Own("status"), "offline", true};
               },
               [this] { OnConnected(); }, [this] { OnLost(); },
               [this](const Message& message) { OnMessage(message, ReadClocks()); },
               [this](const std::string& what, const std::string& why) { Refused(what, why); }},
              links_.patience),
      commands_(links_.store, links_.sink, "mqtt:" + settings_.client, [this] { client_.Wake(); }) {
  if (settings_.payload == config::Mqtt::Payload::sparkplug) {
    const auto write = [this](bus::PointRef at, const std::string& value, bool retained) {
      const auto line = links_.store.line(at.device);
      const auto device = links_.store.device(at.device);
      if (!settings_.commands || !line || !device) return;
      ++shown_.commands;
      const std::string topic = topics_.Of(line->name, device->name, device->points[at.point].name);
      commands_.Take(topic, at, {topic, value, retained}, ReadClocks());
    };
    node_.emplace(settings_, config->name, topics_.Own("sync"), links_.store, live_, client_,
                  write);
  }
  Reload(config);
}

void Session::Reload(const std::shared_ptr<const config::Config>& config) {
  config_ = config;
  live_.Configure(config, [this](const std::string& line, const std::string& device,
                                 const config::Point& point) {
    client_.Publish(topics_.Of(line, device, point.name), "", 1, true);
  });
  by_topic_.clear();
  units_.clear();
  for (std::uint32_t device = 0; device < links_.store.device_count(); ++device) {
    const auto line = links_.store.line(device);
    const auto its = links_.store.device(device);
    if (!line || !its || links_.store.gone(device)) continue;
    for (std::uint32_t point = 0; point < its->points.size(); ++point) {
      const config::Point& one = its->points[point];
      by_topic_[TopicHash(topics_.Of(line->name, its->name, one.name))] = {device, point};
    }
  }
  for (const config::HistoryPoint& one : config->history.points) {
    std::uint32_t first = 0;
    for (const config::Line& line : config->lines) {
      const std::uint32_t number = one.device - first;
      first += static_cast<std::uint32_t>(line.devices.size());
      if (one.device >= first) continue;
      const config::Device& device = line.devices[number];
      const config::Point& point = device.points[one.point];
      units_[line.name + "." + device.name + "." + point.name] = point.unit;
      break;
    }
  }
  if (node_) node_->Rebirth();
  next_entities_ = 0;
  entities_.clear();
  if (!settings_.homeassistant) return;
  for (std::uint32_t device = 0; device < live_.size(); ++device) {
    EachEntity(device, [this](const Entity& entity) { entities_.insert(TopicHash(entity.topic)); });
  }
  // Entities of points that are gone are emptied as at the start.
  if (client_.phase() == Client::Phase::connected) StartTidying();
}

void Session::EachEntity(std::uint32_t device,
                         const std::function<void(const Entity&)>& visit) const {
  const auto line = links_.store.line(device);
  const auto its = links_.store.device(device);
  if (!line || !its || links_.store.gone(device)) return;
  for (std::uint32_t point = 0; point < its->points.size(); ++point) {
    const config::Point& one = its->points[point];
    if (!live_.Has(device, point) && one.access != config::Access::write) continue;
    const auto entity = EntityOf(settings_, topics_, config_->name, *line, *its, one);
    if (entity) visit(*entity);
  }
}

void Session::SendEntities() {
  for (; next_entities_ < live_.size() && !client_.busy(); ++next_entities_) {
    EachEntity(next_entities_, [this](const Entity& entity) {
      client_.Publish(entity.topic, entity.payload, 0, true);
    });
  }
}

void Session::StartTidying() {
  if (settings_.homeassistant) client_.Subscribe(EntityFilter(config_->name));
  if (!node_ && topics_.filter_is_own()) client_.Subscribe(topics_.Filter());
  tidy_until_ = ReadClocks().instant + kTidyTime;
}

std::optional<bus::PointRef> Session::Find(const std::string& topic) const {
  const auto found = by_topic_.find(TopicHash(topic));
  if (found == by_topic_.end()) return std::nullopt;
  const auto line = links_.store.line(found->second.device);
  const auto device = links_.store.device(found->second.device);
  if (!line || !device) return std::nullopt;
  // Two topics can have the same hash.
  const std::string& point = device->points[found->second.point].name;
  if (topics_.Of(line->name, device->name, point) != topic) return std::nullopt;
  return found->second;
}

std::int64_t Session::NextSeq(WallTime now) {
  seq_ = std::max<std::int64_t>(seq_ + 1, now.time_since_epoch() / 1ms);
  return seq_;
}

void Session::Note(const std::string& topic, const Delivery& delivery) {
  const std::string what = "messages to " + topic;
  if (delivery.kind == Delivery::Kind::confirmed) {
    if (refused_ == what) shown_.refused.clear();
  } else if (delivery.by_broker) {
    Refused(what, delivery.why);
  }
}

void Session::Refused(const std::string& what, const std::string& why) {
  const std::string text =
      "the broker " + client_.broker().Address() + " does not accept " + what + ": " + why;
  if (text != shown_.refused) log::Warn("mqtt: {}", text);
  shown_.refused = text;
  refused_ = what;
}

Delivered Session::Noting(const std::string& topic) {
  return [this, topic](const Delivery& delivery) { Note(topic, delivery); };
}

void Session::OnConnected() {
  online_ = false;
  shown_.refused.clear();
  live_.StartAnew();
  alarms_due_ = Instant{};
  events_open_ = 0;
  events_failed_ = false;
  events_due_ = {};
  stored_accepted_ = false;
  next_entities_ = 0;
  StartTidying();
  if (node_) return node_->OnConnected();
  if (settings_.commands) client_.Subscribe(topics_.Filter() + kSet);
}

void Session::OnLost() {
  online_ = false;
  const MutexLock lock(outside_);
  if (!left_ && links_.connected) links_.connected(false);
}

void Session::OnMessage(const Message& message, Now now) {
  if (node_) {
    node_->Take(message);
  } else if (settings_.commands && message.topic.ends_with(kSet)) {
    const std::string topic = message.topic.substr(0, message.topic.size() - sizeof(kSet) + 1);
    ++shown_.commands;
    commands_.Take(topic, Find(topic), message, now);
  } else if (message.retained && !message.payload.empty()) {
    Tidy(message);
  }
}

/// Empties a retained message that belongs to no point any more.
void Session::Tidy(const Message& message) {
  if (!tidy_until_) return;
  for (const char* own : {"status", "events", "alarms"}) {
    if (message.topic == topics_.Own(own)) return;
  }
  const auto at = Find(message.topic);
  if (at && live_.Has(at->device, at->point)) return;
  if (IsEntityTopic(message.topic)) {
    // Other programs may use the name of the gateway below homeassistant/ as well.
    const bool is_own = message.payload.find(EntityId(config_->name)) != std::string::npos;
    if (!is_own || entities_.contains(TopicHash(message.topic))) return;
  }
  client_.Publish(message.topic, "", 1, true, Noting(message.topic));
}

void Session::SendValues(Now now) {
  client_.Gather(true);
  live_.Send(now, [&](const LivePoints::Point& at, const Reading& reading) {
    if (client_.busy()) return false;
    const std::string topic = topics_.Of(at.line.name, at.device.name, at.point.name);
    // The broker answers only to QoS 1, so the first value of each device asks whether its topics
    // may be written.
    const std::string failed = client_.Publish(
        topic, PointPayload(settings_.payload, at.point.unit, reading, NextSeq(now.wall)),
        at.first ? 1 : 0, true, at.first ? Noting(topic) : Delivered());
    if (failed.empty()) ++shown_.messages;
    return failed.empty();
  });
  client_.Gather(false);
}

void Session::SendOnline() {
  const std::string topic = topics_.Own("status");
  // With Sparkplug the will is NDEATH, so nobody would publish `offline` after a loss.
  const bool again = online_;
  online_ =
      node_ || client_.Publish(topic, "online", 1, true, Noting(topic), kOnlineLifetime).empty();
  online_due_ = ReadClocks().instant + kOnlineEvery;
  if (!online_ || again) return;
  const MutexLock lock(outside_);
  if (!left_ && links_.connected) links_.connected(true);
}

void Session::SendAlarms(Now now) {
  if (!links_.feed) return;
  const auto changes = links_.feed->alarms().Take(alarms_version_, kAlarmsAtATime);
  for (const events::AlarmBoard::Change& change : changes) {
    alarms_version_ = change.version;
    if (change.alarm.state == events::AlarmState::normal) {
      alarms_.erase(change.alarm.key());
    } else {
      alarms_[change.alarm.key()] = change.alarm;
    }
  }
  if (!changes.empty() && !alarms_due_) alarms_due_ = alarms_sent_ + kAlarmPause;
  if (!HasCome(alarms_due_, now.instant)) return;
  std::vector<events::Alarm> present;
  for (const auto& [key, alarm] : alarms_) present.push_back(alarm);
  const std::string topic = topics_.Own("alarms");
  client_.Publish(topic, AlarmsPayload(std::move(present)), 1, true, Noting(topic));
  alarms_due_.reset();
  alarms_sent_ = now.instant;
}

/// Finds the event with which to go on. The book has no place before the file of events is open.
bool Session::FindPlace() {
  const std::int64_t newest = links_.feed->newest();
  if (newest == 0) return false;
  const auto kept = links_.cursors ? links_.cursors->Of(kConsumer) : std::nullopt;
  place_ = kept ? kept->seq : std::max<std::int64_t>(newest - kEventImage, 0);
  if (*place_ <= newest) return true;
  shown_.events_note = "the broker has confirmed event " + std::to_string(*place_) +
                       ", but the newest event is " + std::to_string(newest) +
                       ": the events were restored from an older copy, and the gateway cannot know "
                       "which later events the broker has";
  log::Warn("mqtt: {}", shown_.events_note);
  place_ = newest;
  return true;
}

void Session::EndEvents(const Delivery& delivery, std::int64_t seq) {
  if (events_open_ == 0) return;
  --events_open_;
  Note(topics_.Own("events"), delivery);
  if (delivery.kind == Delivery::Kind::retry || delivery.kind == Delivery::Kind::denied) {
    events_failed_ = true;
    events_due_ = ReadClocks().instant + kEventPause;
  }
  if (delivery.kind == Delivery::Kind::refused) ++shown_.events_refused;
  if (events_failed_) return;
  if (delivery.kind == Delivery::Kind::confirmed) ++shown_.events;
  if (events_open_ > 0) return;
  place_ = seq;
  if (links_.cursors) links_.cursors->Set(kConsumer, {seq, true});
  client_.Wake();
}

void Session::SendEvents() {
  if (!links_.feed || !links_.keeps_events || events_open_ > 0) return;
  if (ReadClocks().instant < events_due_) return;
  if (!place_ && !FindPlace()) return;
  events_failed_ = false;
  const auto events = links_.feed->Take(*place_, kEventsAtATime);
  if (events.empty()) return;
  const std::int64_t first = events.front().record.seq;
  if (first > *place_ + 1) {
    shown_.events_skipped += static_cast<std::uint64_t>(first - *place_ - 1);
    place_ = first - 1;
  }
  const std::int64_t last = events.back().record.seq;
  events_open_ = events.size();
  for (const events::FedEvent& event : events) {
    const std::string failed =
        client_.Publish(topics_.Own("events"), EventPayload(event.record), 1, false,
                        [this, last](const Delivery& delivery) { EndEvents(delivery, last); });
    if (!failed.empty()) EndEvents({Delivery::Kind::retry, failed}, last);
  }
}

void Session::SendPortion() {
  if (!open_.portion) return;
  const outlet::Portion portion = std::move(*std::exchange(open_.portion, std::nullopt));
  auto done = std::exchange(open_.done, nullptr);
  if (node_) return node_->SendStored(portion, done);
  SendStored(portion, std::move(done));
}

void Session::SendStored(const outlet::Portion& portion, std::function<void(outlet::Answer)> done) {
  struct Open {
    std::size_t left = 0;
    std::vector<std::size_t> denied{};
    outlet::Answer answer{};
    std::function<void(outlet::Answer)> done;
  };
  const auto open = std::make_shared<Open>();
  open->left = portion.values.size();
  open->done = std::move(done);
  const auto end = [this, open](std::size_t index, const std::string& topic,
                                const Delivery& delivery) {
    using Kind = outlet::Answer::Kind;
    Note(topic, delivery);
    if (delivery.kind == Delivery::Kind::confirmed) stored_accepted_ = true;
    if (delivery.kind == Delivery::Kind::denied) {
      open->denied.push_back(index);
    } else if (delivery.kind == Delivery::Kind::refused) {
      open->answer.refused.push_back(index);
      if (open->answer.kind == Kind::confirmed) open->answer.kind = Kind::refused;
    } else if (delivery.kind == Delivery::Kind::retry) {
      open->answer.kind = Kind::retry;
    }
    if (!delivery.why.empty()) open->answer.why = "the broker does not confirm: " + delivery.why;
    if (--open->left > 0) return;
    // Somebody forbids single points on purpose. If nothing is permitted, the access rules are
    // probably wrong, and no value must be lost until they are corrected.
    if (!open->denied.empty() && !stored_accepted_) open->answer.kind = Kind::retry;
    if (!open->denied.empty() && open->answer.kind != Kind::retry) {
      open->answer.kind = Kind::refused;
      std::ranges::copy(open->denied, std::back_inserter(open->answer.refused));
    }
    open->done(open->answer);
  };
  client_.Gather(true);
  for (std::size_t i = 0; i < portion.values.size(); ++i) {
    const outlet::KeptValue& value = portion.values[i];
    const auto names = Split(value.point, '.');
    if (names.size() != 3) {
      end(i, value.point, {Delivery::Kind::refused, "it is the name of no point"});
      continue;
    }
    const std::string topic =
        topics_.Of(std::string(names[0]), std::string(names[1]), std::string(names[2])) +
        "/history";
    const auto unit = units_.find(value.point);
    const Reading reading{value.entry.value, value.entry.quality,
                          history::ToWall(value.entry.time)};
    const std::string failed = client_.Publish(
        topic,
        PointPayload(config::Mqtt::Payload::json, unit == units_.end() ? "" : unit->second, reading,
                     value.seq),
        1, false, [end, i, topic](const Delivery& delivery) { end(i, topic, delivery); });
    if (!failed.empty()) end(i, topic, {Delivery::Kind::retry, failed});
  }
  client_.Gather(false);
}

void Session::SendAnswers() {
  for (const Commands::Answer& answer : commands_.TakeAnswers()) {
    client_.Publish(answer.topic, answer.payload, 1, false, Noting(answer.topic));
  }
}

void Session::Work(Now now) {
  SendAnswers();
  if (HasCome(tidy_until_, now.instant)) {
    if (settings_.homeassistant) client_.Unsubscribe(EntityFilter(config_->name));
    if (!node_) client_.Unsubscribe(topics_.Filter());
    tidy_until_.reset();
  }
  if (node_) {
    node_->Send(now);
  } else {
    SendValues(now);
    if (settings_.homeassistant) SendEntities();
  }
  const bool ready = node_ ? node_->born() : live_.all_sent();
  if (ready && (!online_ || (!node_ && now.instant >= online_due_))) SendOnline();
  if (!online_) return;
  SendAlarms(now);
  SendEvents();
  SendPortion();
}

void Session::TakeMail() {
  std::shared_ptr<const config::Config> config;
  {
    const MutexLock lock(mutex_);
    config = std::exchange(mail_.config, nullptr);
    if (mail_.portion) {
      open_.portion = std::exchange(mail_.portion, std::nullopt);
      open_.done = std::exchange(mail_.done, nullptr);
    }
  }
  if (config) Reload(config);
  if (!open_.portion || client_.phase() == Client::Phase::connected) return;
  open_.portion.reset();
  std::exchange(open_.done, nullptr)({outlet::Answer::Kind::retry, client_.trouble()});
}

Instant Session::Round(bool last) {
  {
    const MutexLock lock(outside_);
    if (left_) return kWhenWoken;
  }
  if (last) {
    Farewell();
    return kWhenWoken;
  }
  TakeMail();
  if (client_.phase() == Client::Phase::connected) Work(ReadClocks());
  Show();
  client_.Run(ReadClocks().instant + kTick);
  return Instant{};
}

void Session::Farewell() {
  const Instant end = ReadClocks().instant + kFarewell;
  if (client_.phase() == Client::Phase::connected && !node_) {
    SendAnswers();
    // A message with QoS 1 could wait behind stored values that the broker has not confirmed.
    client_.Publish(topics_.Own("status"), "offline", 0, true);
    const Now now = ReadClocks();
    live_.Each([&](const LivePoints::Point& at) {
      while (client_.busy() && ReadClocks().instant < end) client_.Run(ReadClocks().instant + 10ms);
      if (ReadClocks().instant >= end) return;
      const Reading gone{{}, Quality::bad_not_connected, now.wall};
      client_.Publish(topics_.Of(at.line.name, at.device.name, at.point.name),
                      PointPayload(settings_.payload, at.point.unit, gone, NextSeq(now.wall)), 0,
                      true);
    });
    while (client_.busy() && ReadClocks().instant < end) client_.Run(ReadClocks().instant + 10ms);
  }
  // The broker publishes the will: `offline`, or NDEATH.
  client_.Close();
  TakeMail();
  Show();
}

void Session::Show() {
  if (node_) shown_.messages = node_->values();
  shown_.phase = client_.phase();
  shown_.broker = client_.broker().Address();
  shown_.trouble = client_.trouble();
  shown_.times_lost = client_.times_lost();
  const MutexLock lock(mutex_);
  state_ = shown_;
}

void Session::Configure(std::shared_ptr<const config::Config> config) {
  const MutexLock lock(mutex_);
  mail_.config = std::move(config);
}

void Session::StopCommands() { commands_.Stop(); }

void Session::Leave() {
  const MutexLock lock(outside_);
  left_ = true;
}

SessionState Session::state() const {
  const MutexLock lock(mutex_);
  return state_;
}

void Session::Send(outlet::Portion portion, std::function<void(outlet::Answer)> done) {
  {
    const MutexLock lock(mutex_);
    mail_.portion = std::move(portion);
    mail_.done = std::move(done);
  }
  client_.Wake();
}

}  // namespace baudgate::mqtt
