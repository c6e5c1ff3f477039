// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/output/dds_json.h"

#include <algorithm>
#include <string>

#include "gateway/base/shown.h"
#include "gateway/outputs/dds/domain.h"

namespace baudgate::dds {
namespace {

using Json = nlohmann::ordered_json;
using Phase = dds::LinkState::Phase;

const char* Name(Phase phase) {
  switch (phase) {
    case Phase::starting:
      return "starting";
    case Phase::up:
      return "up";
    case Phase::silent:
      return "silent";
    case Phase::waiting:
      break;
  }
  return "waiting";
}

std::string Diagnose(const dds::LinkState& state, Instant now) {
  const std::string times =
      state.times_lost > 1 ? " (lost " + Plural(state.times_lost, "time") + ")" : "";
  if (state.phase == Phase::silent) {
    const std::string since = FormatAge(now - state.heard) + times;
    if (state.opened) return "the process has read no samples of the gateway for " + since;
    return "the process has been opening DDS for " + since +
           "; the DDS library asks the name service for its user: check that 'getent passwd' "
           "answers at once";
  }
  if (state.phase != Phase::waiting) return {};
  if (state.reason.empty()) return "the process has not connected yet";
  std::string text = "the process " + state.reason;
  if (state.next_start) {
    text += "; the gateway starts it again in " +
            FormatAge(std::max(Duration(0), *state.next_start - now));
  }
  return text + times;
}

/// Returns the counts as text, e.g. "accepted 12345 datagrams, refused 40: 38 fragments, 2 broken
/// parameter lists"; empty: no datagram was received.
std::string DatagramText(const dds::DatagramCounters& datagrams) {
  const std::uint64_t all = datagrams.AllRefused();
  if (datagrams.passed == 0 && all == 0) return {};
  std::string text = "accepted " + Plural(datagrams.passed, "datagram") + ", refused ";
  if (all == 0) return text + "none";
  text += std::to_string(all);
  const char* before = ": ";
  for (std::size_t i = 0; i < dds::kRefusals; ++i) {
    const std::uint64_t count = datagrams.refused[i];
    if (count == 0) continue;
    const dds::RefusalWords& says = dds::kRefusalWords[i];
    text += before;
    text +=
        count == 1 ? std::string(says.words) : std::to_string(count) + " " + std::string(says.many);
    before = ", ";
  }
  return text;
}

Json DatagramsJson(const dds::DatagramCounters& datagrams) {
  Json refused = Json::object();
  for (std::size_t i = 1; i < dds::kRefusals; ++i) {
    refused[std::string(dds::kRefusalWords[i].name)] = datagrams.refused[i];
  }
  return {{"let_in", datagrams.passed},
          {"refused", refused},
          {"participants", datagrams.participants},
          {"text", DatagramText(datagrams)}};
}

/// Returns the counts of write requests; null: writing is not allowed. "text" is e.g. "took 12
/// write requests, dropped 3 that came too fast".
Json RequestsJson(const dds::LinkState& state) {
  if (!state.requests) return nullptr;
  std::string text = "took " + Plural(*state.requests, "write request");
  if (state.requests_dropped > 0) {
    text += ", dropped " + std::to_string(state.requests_dropped) + " that came too fast";
  }
  return {{"taken", *state.requests}, {"dropped", state.requests_dropped}, {"text", text}};
}

/// Returns the counts of published and skipped events; null: no device has events. "text" is e.g.
/// "published 30 events, skipped 2 that were already deleted".
Json EventsJson(const dds::LinkState& state) {
  if (!state.events) return nullptr;
  std::string text = "published " + Plural(*state.events, "event");
  if (state.events_skipped > 0) {
    text += ", skipped " + std::to_string(state.events_skipped) + " that were already deleted";
  }
  return {{"published", *state.events}, {"skipped", state.events_skipped}, {"text", text}};
}

}  // namespace

Json DdsJson(int domain, const dds::LinkState& state, Instant now) {
  Json json;
  json["domain"] = domain;
  json["state"] = Name(state.phase);
  const dds::Subscribers& readers = state.subscribers;
  json["subscribers"] = readers.points;
  json["readers"] = {{"points", readers.points},
                     {"devices", readers.devices},
                     {"events", readers.events},
                     {"alarms", readers.alarms}};
  json["samples"] = state.written;
  json["refused"] = state.refused;
  json["times_lost"] = state.times_lost;
  json["last_end"] = state.reason.empty() ? Json(nullptr) : Json(state.reason);
  json["heard_ms"] =
      state.phase == Phase::waiting ? Json(nullptr) : Json((now - state.heard) / 1ms);
  json["next_start_ms"] =
      state.next_start ? Json(std::max(Duration(0), *state.next_start - now) / 1ms) : Json(nullptr);
  json["requests"] = RequestsJson(state);
  json["events"] = EventsJson(state);
  json["datagrams"] = DatagramsJson(state.datagrams);
  const std::string trouble = Diagnose(state, now);
  json["advice"] = trouble.empty() ? Json::array() : Json::array({trouble});
  for (const std::string& remark : state.remarks) json["advice"].push_back(remark);
  return json;
}

}  // namespace baudgate::dds
