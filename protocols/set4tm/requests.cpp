// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/requests.h"

#include <utility>

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/conversation_steps.h"
#include "protocols/set4tm/expect.h"
#include "protocols/set4tm/snapshot.h"

namespace baudgate::protocols::set4tm {
namespace {

const Bytes kLinkOnly = {kLinkTest};
/// A meter that has never answered may be set to the other checksum: one probe of so many is sent
/// with that. No meter takes it for a write.
constexpr unsigned kOtherModeEvery = 4;

}  // namespace

MeterRequests::MeterRequests(MeterParts& parts)
    : parts_(parts), address_(ParseAddress(parts.device.address).value()) {}

Request MeterRequests::Make(RequestKind kind, View pdu) {
  kind_ = kind;
  const bool broadcast = kind == RequestKind::latch;
  Request request;
  request.bytes =
      MakeFrame(broadcast ? Bytes{kBroadcast} : address_, pdu, parts_.settings.checksum);
  request.expect = Expect(request.bytes, parts_.settings);
  request.stamped = broadcast || kind == RequestKind::latch_time;
  return request;
}

Result<Request> MeterRequests::Next(const Task& task, Instant now) {
  const bool writes = task.kind == Task::Kind::write;
  const auto correction =
      writes ? CorrectionOf(task, now) : Result<Bytes>(Error{"nothing is to be written"});
  if (writes && !correction) return Error{correction.error()};
  if (task.kind == Task::Kind::probe && !parts_.session.has_answered() &&
      ++probes_ % kOtherModeEvery == 0) {
    return InOtherMode();
  }
  const bool may_latch = !writes && task.kind != Task::Kind::probe;
  if (may_latch && parts_.latched.IsDue(now)) return Make(RequestKind::latch, LatchPdu());
  if (auto request = ForSession(task, now)) return std::move(*request);
  return writes ? Make(RequestKind::write, *correction) : Own(task, now);
}

Request MeterRequests::InOtherMode() {
  kind_ = RequestKind::other_mode;
  Request request;
  request.bytes = MakeFrame(address_, kAskSerial, Other(parts_.settings.checksum));
  request.expect = Expect(request.bytes, parts_.settings);
  return request;
}

std::optional<Request> MeterRequests::ForSession(const Task& task, Instant now) {
  const bool probes = task.kind == Task::Kind::probe;
  const bool writes = task.kind == Task::Kind::write;
  Request request;
  switch (parts_.session.NeedBefore(probes, parts_.archive.wants_serial(), now)) {
    case MeterSession::Need::nothing:
      return std::nullopt;
    case MeterSession::Need::link:
      return Make(RequestKind::link, kLinkOnly);
    case MeterSession::Need::open:
      request = Make(RequestKind::open, parts_.session.OpenPdu());
      request.unlike_polls = true;  // answered by a status; "00" answers nothing else
      // A meter that answers too late must not get a wrong password three times.
      request.expect.repeatable = parts_.session.accepted();
      request.prepares = writes;
      return request;
    case MeterSession::Need::serial:
      request = Make(RequestKind::serial, kAskSerial);
      request.prepares = writes;
      return request;
  }
  return std::nullopt;
}

Request MeterRequests::Own(const Task& task, Instant now) {
  if (task.kind == Task::Kind::events) {
    if (const auto question = parts_.identification.Question({})) {
      return Make(RequestKind::question, *question);
    }
    return Make(RequestKind::record, parts_.archive.NextRecord(now));
  }
  if (AsksLatchTime(task, now)) return Make(RequestKind::latch_time, AskLatchTime());
  if (task.kind != Task::Kind::background) return Read(task.query);
  if (const auto question = parts_.archive.Question())
    return Make(RequestKind::question, *question);
  return Make(RequestKind::background, parts_.archive.NextInBackground(now));
}

Request MeterRequests::Read(std::size_t query) {
  auto [pdu, tries_masks] = parts_.reads.ReadOf(query);
  if (const auto question = parts_.identification.Question(parts_.reads.fields().Matches(pdu))) {
    return Make(RequestKind::question, *question);
  }
  parts_.reads.Number(pdu);
  Request request = Make(tries_masks ? RequestKind::trial : RequestKind::read, pdu);
  request.stamped = AsksClock(pdu);
  if (request.stamped) parts_.drift.OnAsked();
  if (tries_masks) request.expect.repeatable = false;
  return request;
}

/// In the background where no job is due: another meter's task may have sent the broadcast.
bool MeterRequests::AsksLatchTime(const Task& task, Instant now) const {
  if (!parts_.latched.tells()) return false;
  if (task.kind == Task::Kind::background)
    return parts_.latched.WantsTime() || !parts_.archive.IsDue(now);
  return parts_.latched.WantsTime() && parts_.reads.ReadsLatched(task.query);
}

Result<Bytes> MeterRequests::CorrectionOf(const Task& task, Instant now) const {
  if (parts_.device.points[task.point].write != kCorrectsClock) {
    return Error{"SET-4TM meters are read only here"};
  }
  return ClockCorrection(task.value, parts_.drift, now);
}

}  // namespace baudgate::protocols::set4tm
