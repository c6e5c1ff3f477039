// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/record_requests.h"

#include <utility>

#include "gateway/outputs/control/alarm_requests.h"
#include "gateway/outputs/control/history_requests.h"
#include "gateway/outputs/status/audit_json.h"
#include "gateway/outputs/status/events_json.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/audit/audit_source.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::control {
namespace {

/// On the disk.
bool KeepsEvents(const Gateway& gateway) {
  return gateway.info.events != nullptr && !gateway.info.events->state().in_memory;
}

KeptValues Kept(const Gateway& gateway) {
  return {*gateway.config, gateway.info.history.get(),
          KeepsEvents(gateway) ? gateway.info.events : nullptr};
}

}  // namespace

/// One page; the client asks for the next with what this one says.
Reply ShowWrites(const Gateway& gateway, const Request& request) {
  if (gateway.info.audit == nullptr) {
    return Refused(
        kUnavailable,
        "nothing of this gateway can be written, so there are no records of writes: no "
        "device has 'write: allow', no line has 'ask: write', and no route can be written through");
  }
  audit::PageQuery query;
  if (TextOf(request.json, "order") == "settled") query.order = audit::PageQuery::Order::settled;
  query.after = NumberOf(request.json, "after").value_or(0);
  query.since = TimeOf(request.json, "since_ms");
  const audit::AuditState state =
      gateway.info.audit->state();  // before the page: it may open meanwhile
  const auto page = gateway.info.audit->Read(query);
  if (!page) return Refused(kUnavailable, "the records of writes cannot be read: " + page.error());
  Json json = PageJson(*page);
  json["audit"] = AuditJson(state);
  return {OneLine(json)};
}

/// One page, as of writes. A device that is not configured any more still has its events.
Reply ShowEvents(const Gateway& gateway, const Request& request) {
  if (!KeepsEvents(gateway)) return Refused(kUnavailable, kNoEvents);
  events::PageQuery query;
  query.after = NumberOf(request.json, "after").value_or(0);
  query.since = TimeOf(request.json, "since_ms");
  const std::string target = TextOf(request.json, "target");
  const std::size_t dot = target.find('.');
  if (dot != std::string::npos) query.line = target.substr(0, dot);
  query.device = dot == std::string::npos ? target : target.substr(dot + 1);
  const events::EventsState state = gateway.info.events->state();  // before the page, as above
  const auto page = gateway.info.events->Read(query);
  if (!page) return Refused(kUnavailable, "the events cannot be read: " + page.error());
  if (page->records.empty() && !target.empty()) {
    if (const Status known = KnowsDevice(*gateway.config, query.line, query.device); !known) {
      return Refused(kUnknown, known.error());
    }
  }
  Json json = PageJson(*page);
  json["events"] = EventsJson(state);
  return {OneLine(json)};
}

Reply ShowAlarms(const Gateway& gateway, const Request& request) {
  if (gateway.info.events == nullptr) return Refused(kUnavailable, kNoEvents);
  const events::EventsState state = gateway.info.events->state();  // before the page, as above
  Json json = AlarmsPage(*gateway.info.events, NumberOf(request.json, "after").value_or(0));
  json["events"] = EventsJson(state);
  return {OneLine(json)};
}

Reply Acknowledge(const Gateway& gateway, const Request& request) {
  if (gateway.info.events == nullptr) return Refused(kUnavailable, kNoEvents);
  auto query = FindAlarms(*gateway.config, *gateway.info.events, TextOf(request.json, "target"));
  if (!query) return Refused(kUnknown, query.error());
  query->by = request.client.name;
  gateway.info.events->Acknowledge(
      *query, [later = request.later](const events::Acknowledged& done) { later(AckJson(done)); });
  return {};
}

Reply ShowHistory(const Gateway& gateway, const Request& request) {
  return {OneLine(HistoryPage(request.json, Kept(gateway)))};
}

Reply ShowKeptPoints(const Gateway& gateway, const Request& request) {
  return {OneLine(KeptPoints(request.json, Kept(gateway)))};
}

}  // namespace baudgate::control
