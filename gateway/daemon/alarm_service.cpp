// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/alarm_service.h"

#include <optional>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/bus/devices/device_health.h"
#include "gateway/daemon/news_kind.h"
#include "protocols/modbus/pdu/modbus_pdu.h"

namespace baudgate {
namespace {

using events::OwnAlarms;
using events::Trouble;
using modbus::RouteOutcome;

/// Two requests without a reply that are so far apart are as good as many.
constexpr Duration kLongSilence = 30s;
/// A unit that no client has asked for during this time.
constexpr Duration kForgotten = 1h;

/// What the name of the alarm says already is no reason.
std::string WhyOf(const std::string& reason) {
  return reason == Name(Outcome::no_reply) ? std::string() : reason;
}

/// A gateway at the other end of the route reports that the slave does not answer.
bool IsNoTarget(const RoutedReply& reply) {
  return reply.outcome == Outcome::refused && reply.pdu.size() == 2 &&
         (reply.pdu[1] == modbus::kNoPath || reply.pdu[1] == modbus::kNoTarget);
}

}  // namespace

void AlarmService::TellAll(OwnAlarms::Records records) {
  for (events::EventRecord& record : records) tell_(std::move(record));
}

void AlarmService::OnNews(const std::string& line, const std::string& device, const News& news,
                          Now at) {
  const OwnAlarms::Place place{line, device};
  const MutexLock lock(mutex_);
  if (news.what == News::What::not_in_use || news.what == News::What::port_lent) {
    return TellAll(alarms_.SetInUse(place, news.over, at));
  }
  const auto trouble = KindOf(news.what).trouble;
  if (!trouble) return;
  if (trouble == Trouble::replaced) return TellAll(alarms_.Happen(*trouble, place, news.text, at));
  if (news.over) return TellAll(alarms_.End(*trouble, place, at));
  alarms_.Begin(*trouble, place, WhyOf(news.text), at);
}

void AlarmService::OnUnused(const std::string& line, const std::string& device, Now now) {
  const MutexLock lock(mutex_);
  TellAll(alarms_.SetInUse({line, device}, false, now));
}

/// How a slave would have answered a request that was not sent is not known. Where the line is
/// down its own alarm says so.
void AlarmService::OnRouted(const modbus::RoutedReport& end, Now now) {
  const config::Route& route = end.route;
  const OwnAlarms::Place unit{route.line, events::UnitName(end.unit)};
  const bool answered = end.end == RouteOutcome::ok || end.end == RouteOutcome::refused;
  const MutexLock lock(mutex_);
  if (route.line.empty()) {
    const OwnAlarms::Place server{"", HostAndPort(route.host, route.port)};
    if (answered) TellAll(alarms_.End(Trouble::server_away, server, now));
    if (!answered && end.reply.outcome == Outcome::line_down) {
      alarms_.Begin(Trouble::server_away, server, end.reply.reason, now);
    }
  } else if (end.reply.outcome == Outcome::line_down) {
    return;
  }
  if (answered && !IsNoTarget(end.reply)) {
    OnAnswered(unit, now);
  } else if (answered) {
    OnUnanswered(unit, "the gateway there answers exception " + HexByte(end.reply.pdu[1]), now);
  } else if (end.end == RouteOutcome::no_reply) {
    OnUnanswered(unit, WhyOf(end.reply.reason), now);
  }
}

void AlarmService::OnAnswered(const OwnAlarms::Place& unit, Now now) {
  unanswered_.erase(unit);
  TellAll(alarms_.End(Trouble::unit_silent, unit, now));
}

/// One lost reply is no silence: it takes as many as a device of the gateway's own, or two that are
/// far apart. The delay of the alarm counts from the first.
void AlarmService::OnUnanswered(const OwnAlarms::Place& unit, const std::string& why, Now now) {
  Unanswered& its = unanswered_.try_emplace(unit, Unanswered{.first = now}).first->second;
  ++its.requests;
  its.last = now.instant;
  const Duration since = now.instant - its.first.instant;
  const bool many = its.requests >= DeviceHealth::kOfflineCount;
  const bool long_ago = its.requests > 1 && since >= kLongSilence;
  if (many || long_ago) alarms_.Begin(Trouble::unit_silent, unit, why, its.first);
}

/// Units that no client asks for any more: whether they would answer is not known.
void AlarmService::Forget(Now now) {
  for (auto one = unanswered_.begin(); one != unanswered_.end();) {
    if (now.instant - one->second.last < kForgotten) {
      ++one;
      continue;
    }
    TellAll(alarms_.End(Trouble::unit_silent, one->first, now));
    one = unanswered_.erase(one);
  }
}

void AlarmService::Look(std::span<const DiskState> disks, Now now) {
  const MutexLock lock(mutex_);
  for (const DiskState& one : disks) {
    if (one.disk == Disk::opening) continue;
    if (one.disk == Disk::fine) {
      TellAll(alarms_.End(one.trouble, {}, now));
    } else {
      alarms_.Begin(one.trouble, {}, one.why, now);
    }
  }
  Forget(now);
  TellAll(alarms_.Look(now));
}

void AlarmService::Renew(std::shared_ptr<const config::Config> config,
                         const std::set<std::string>& begun) {
  const MutexLock lock(mutex_);
  alarms_.Renew(std::move(config), begun);
}

}  // namespace baudgate
