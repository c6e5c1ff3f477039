// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/point_requests.h"

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "gateway/outputs/control/request.h"

namespace baudgate::control {
namespace {

constexpr std::size_t kLongestClient = 64;

bool IsConfirmed(const status::Json& request) {
  const auto confirm = request.find("confirm");
  return confirm != request.end() && confirm->is_boolean() && confirm->get<bool>();
}

status::Json ToJson(const WriteResult& result) {
  status::Json json = {
      {"end", Name(result.end)}, {"reason", result.reason}, {"read_back", result.read_back}};
  if (result.changed) json["needs"] = "expect";
  return json;
}

/// Returns the points as JSON. "fresh" is true if the value was received after the time `asked`.
status::Json PointsAt(const bus::PointStore& store, std::uint32_t device,
                      const std::vector<std::uint32_t>& points, Instant asked, Instant now) {
  status::Json all = status::Json::array();
  store.Read(device, [&](const bus::DeviceRecord& record) {
    for (const std::uint32_t point : points) {
      status::Json json = status::PointJson(record, point, now);
      const status::Json& age = json["age_ms"];  // in whole ms, rounded down
      json["fresh"] = !age.is_null() && (age.get<std::int64_t>() + 1) * 1ms <= now - asked;
      all.push_back(std::move(json));
    }
  });
  return all;
}

/// Returns the id of a repeatable write; nothing if the request has neither `client` nor `seq`.
/// Returns an error if one of the two is missing or wrong.
Result<std::optional<bus::RequestId>> IdOf(const status::Json& request) {
  const std::string client = TextOf(request, "client");
  const auto seq = request.find("seq");
  if (client.empty() && seq == request.end()) return std::optional<bus::RequestId>();
  if (client.empty() || seq == request.end()) {
    return Error{
        "a write needs both 'client' and 'seq', or neither: the name of your client, and a number "
        "that rises with each request"};
  }
  if (!seq->is_number_unsigned()) return Error{"'seq' must be a whole number, 0 or more"};
  if (client.size() > kLongestClient) return Error{"'client' has 64 characters at most"};
  return std::optional(bus::RequestId{client, seq->get<std::uint64_t>(),
                                      TextOf(request, "target") + " " + TextOf(request, "value") +
                                          (IsConfirmed(request) ? " confirm" : "")});
}

}  // namespace

Result<bus::WriteAsk> PointRequests::AskOf(const config::Config& config,
                                           const status::Json& request) const {
  const auto target = status::FindPoint(config, TextOf(request, "target"));
  if (!target) return Error{target.error()};
  const auto device = store_.device(target->device);
  if (!device) return Error{"a reload has removed " + Quoted(TextOf(request, "target"))};
  const auto value = bus::ParseValue(device->points[target->point], TextOf(request, "value"));
  if (!value) return Error{value.error()};
  bus::WriteAsk ask;
  ask.device = target->device;
  ask.parts.push_back({target->point, *value});
  return ask;
}

Result<status::Json> PointRequests::MayWrite(const config::Config& config,
                                             const status::Json& request, Instant now) const {
  const auto ask = AskOf(config, request);
  if (!ask) return Error{ask.error()};
  const auto denial = gate_.WouldDeny(*ask, now);
  return status::Json{{"may_write", !denial}, {"reason", denial ? denial->text : ""}};
}

bool PointRequests::IsFresh(const bus::RequestId& id, Instant now, Answered answered) {
  using What = bus::RequestBook::Verdict::What;
  bus::RequestAnswer answer;
  {
    const MutexLock lock(mutex_);
    auto verdict = book_.Begin(id, now);
    if (verdict.what == What::fresh || verdict.what == What::under_way) {
      waiting_.emplace_back(id, std::move(answered));
      return verdict.what == What::fresh;
    }
    answer = std::move(verdict.answer);
  }
  answered(ToJson({answer.end, answer.reason}));
  return false;
}

void PointRequests::Finish(const std::optional<bus::RequestId>& id, const Answered& answered,
                           const WriteResult& result, const status::Json& answer) {
  if (!id) return answered(answer);
  std::vector<Answered> waited;
  {
    const MutexLock lock(mutex_);
    book_.End(id->client, id->seq, {result.end, result.reason});
    std::erase_if(waiting_, [&](auto& one) {
      if (one.first != *id) return false;
      waited.push_back(std::move(one.second));
      return true;
    });
  }
  for (const Answered& one : waited) one(answer);
}

Status PointRequests::Write(const config::Config& config, const status::Json& request,
                            const bus::Writer& writer, Instant now, Answered answered) {
  auto ask = AskOf(config, request);
  if (!ask) return Error{ask.error()};
  const auto id = IdOf(request);
  if (!id) return Error{id.error()};
  const auto device = store_.device(ask->device);
  const std::uint32_t point = ask->parts.front().point;
  if (request.contains("expect")) ask->parts.front().expect = TextOf(request, "expect");
  ask->without_selection = IsConfirmed(request);
  ask->deadline = now + bus::kWaitForDevice;
  ask->abandoned = writer.left;
  ask->request = *id;
  if (*id && !IsFresh(**id, now, answered)) return {};
  ask->done = [this, id = *id, answered](const WriteResult& result) {
    Finish(id, answered, result, ToJson(result));
  };
  if (const auto denial = gate_.Submit(writer, std::move(*ask), now)) {
    const bool busy = denial->why == bus::WriteDenial::Why::busy;
    WriteResult result{busy ? WriteEnd::busy : WriteEnd::denied, denial->text};
    result.changed = denial->why == bus::WriteDenial::Why::changed;
    status::Json denied = ToJson(result);
    if (denial->why == bus::WriteDenial::Why::not_selected) denied["needs"] = "confirm";
    if (denial->why == bus::WriteDenial::Why::read_only && device &&
        device->points[point].access != config::Access::read) {
      denied["needs"] = "write: allow";
    }
    Finish(*id, answered, result, denied);
  }
  return {};
}

Status PointRequests::Read(const config::Config& config, const status::Json& request,
                           const bus::Writer& writer, Now now, Answered answered) {
  const auto target = status::FindPoints(config, TextOf(request, "target"));
  if (!target) return Error{target.error()};
  bus::WriteCommand command;
  command.device = target->device;
  command.client = writer.name;
  command.kind = bus::Reads{target->points};
  command.deadline = now.instant + bus::kWaitForDevice;
  command.abandoned = writer.left;
  const Instant asked = now.instant;
  command.done = [this, answered, target = *target, asked](const WriteResult& result) {
    answered(
        {{"read", result.read_back},
         {"reason", result.reason},
         {"points", PointsAt(store_, target.device, target.points, asked, ReadClocks().instant)}});
  };
  if (!sink_.Submit(std::move(command))) {
    answered(
        {{"read", false},
         {"reason", "nothing was sent, because too many commands wait for the line; try again"},
         {"points", PointsAt(store_, target->device, target->points, asked, asked)}});
  }
  return {};
}

}  // namespace baudgate::control
