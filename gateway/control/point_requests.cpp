// SPDX-License-Identifier: Apache-2.0
#include "gateway/control/point_requests.h"

#include <utility>
#include <vector>

#include "gateway/control/request_text.h"
#include "gateway/writes/value_text.h"

namespace baudgate::control {
namespace {

Json ToJson(const WriteResult& result) {
  return {{"end", Name(result.end)}, {"reason", result.reason}, {"read_back", result.read_back}};
}

/// "fresh": the value is one that the device has told since it was asked.
Json PointsAt(const PointStore& store, std::uint32_t device,
              const std::vector<std::uint32_t>& points, Instant asked, Instant now) {
  Json all = Json::array();
  store.Read(device, [&](const DeviceRecord& record) {
    for (const std::uint32_t point : points) {
      Json json = PointJson(record, point, now);
      const Json& age = json["age_ms"];  // rounded down
      json["fresh"] = !age.is_null() && (age.get<std::int64_t>() + 1) * 1ms <= now - asked;
      all.push_back(std::move(json));
    }
  });
  return all;
}

}  // namespace

Result<WriteAsk> PointRequests::AskOf(const config::Config& config, const Json& request) const {
  const auto target = FindPoint(config, TextOf(request, "target"));
  if (!target) return Error{target.error()};
  const config::Point& point = store_.device(target->device).points[target->point];
  const auto value = ParseValue(point, TextOf(request, "value"));
  if (!value) return Error{value.error()};
  WriteAsk ask;
  ask.device = target->device;
  ask.parts.push_back({target->point, *value});
  return ask;
}

Result<Json> PointRequests::MayWrite(const config::Config& config, const Json& request,
                                     Instant now) const {
  const auto ask = AskOf(config, request);
  if (!ask) return Error{ask.error()};
  const auto denial = gate_.WouldDeny(*ask, now);
  return Json{{"may_write", !denial}, {"reason", denial ? denial->text : ""}};
}

Status PointRequests::Write(const config::Config& config, const Json& request, const Writer& writer,
                            Instant now, Answered answered) {
  auto ask = AskOf(config, request);
  if (!ask) return Error{ask.error()};
  const config::Point& point = store_.device(ask->device).points[ask->parts.front().point];
  const auto confirm = request.find("confirm");
  ask->without_selection =
      confirm != request.end() && confirm->is_boolean() && confirm->get<bool>();
  ask->deadline = now + kWaitForDevice;
  ask->abandoned = writer.left;
  ask->done = [answered](const WriteResult& result) { answered(ToJson(result)); };
  if (const auto denial = gate_.Submit(writer, std::move(*ask), now)) {
    const bool busy = denial->why == WriteDenial::Why::busy;
    Json denied = ToJson({busy ? WriteEnd::busy : WriteEnd::denied, denial->text});
    if (denial->why == WriteDenial::Why::not_selected) denied["needs"] = "confirm";
    if (denial->why == WriteDenial::Why::read_only && point.access != config::Access::read) {
      denied["needs"] = "write: allow";
    }
    answered(std::move(denied));
  }
  return {};
}

Status PointRequests::Read(const config::Config& config, const Json& request, const Writer& writer,
                           Now now, Answered answered) {
  const auto target = FindPoints(config, TextOf(request, "target"));
  if (!target) return Error{target.error()};
  WriteCommand command;
  command.device = target->device;
  command.client = writer.name;
  command.kind = Reads{target->points};
  command.deadline = now.instant + kWaitForDevice;
  command.abandoned = writer.left;
  const Instant asked = now.instant;
  command.done = [this, answered, target = *target, asked](const WriteResult& result) {
    answered(
        {{"read", result.read_back},
         {"reason", result.reason},
         {"points", PointsAt(store_, target.device, target.points, asked, ReadClocks().instant)}});
  };
  if (!sink_.Submit(std::move(command))) {
    answered({{"read", false},
              {"reason", "too many commands wait for the line"},
              {"points", PointsAt(store_, target->device, target->points, asked, asked)}});
  }
  return {};
}

}  // namespace baudgate::control
