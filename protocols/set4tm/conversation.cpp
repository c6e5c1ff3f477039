// The session of a SET-4TM meter: channel, serial number, constants, then the queries of its
// points.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/expect.h"
#include "protocols/set4tm/frame_rule.h"
#include "protocols/set4tm/printed.h"
#include "protocols/set4tm/status.h"
#include "protocols/set4tm/values.h"

namespace baudgate::protocols::set4tm {
namespace {

/// The channel lives 20 s; with less than a quarter left it is opened anew (reference, 14.5).
constexpr Duration kChannelTrust = 15s;
/// Three wrong passwords in a row lock writing until midnight (reference, chapter 6): after one
/// there is one more try, and then none until a person has looked.
constexpr Duration kSecondTry = 1h;
constexpr std::size_t kMostTries = 2;
constexpr int kReopens = 1;
constexpr int kRepeats = 1;

const Bytes kLinkOnly = {kLinkTest};
const Bytes kAskSerial = {kRead, kSerialNumber};
const Bytes kAskVariant = {kRead, kVariant};
const Bytes kAskRatios = {kRead, kRatios};

bool Is(View pdu, const Bytes& other) { return std::ranges::equal(pdu, other); }

bool IsSnapshot(View pdu) { return pdu.size() > 2 && pdu[0] == kRead && pdu[1] == kFloatMask; }

/// A step of the session that is nobody's news.
Answer AskAgain() {
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

}  // namespace

MeterConversation::MeterConversation(const config::Device& device)
    : device_(device),
      settings_(ReadSettings(device.options)),
      fields_(device.points),
      plan_(fields_.MakePlan(false)),
      address_(ParseAddress(device.address).value()) {
  OnReconnect();
}

void MeterConversation::OnReconnect() {
  learned_ = {};
  snapshot_ = settings_.snapshot;
  open_ = verified_ = accepted_ = asked_variant_ = asked_ratios_ = false;
  reopened_ = repeated_ = 0;
  plan_ = fields_.MakePlan(snapshot_);
}

Request MeterConversation::Make(View pdu) const {
  Request request;
  request.bytes = MakeFrame(address_, pdu);
  request.expect = Expect(request.bytes, device_.options);
  return request;
}

bool MeterConversation::NeedsConstants(const Bytes& pdu,
                                       bool (*lacks)(Measure, const Scale&)) const {
  const Scale known = scale();
  return std::ranges::any_of(fields_.Matches(pdu), [&](const Match& match) {
    return match.point != kNoPoint && lacks(MeasureOf(match.field.decoder), known);
  });
}

Result<Request> MeterConversation::Ask(const Task& task, Instant now) {
  if (task.kind == Task::Kind::write) return Error{"SET-4TM meters are read only here"};
  // Opening proves presence too: a link test (00) equals its own echo.
  if (task.kind == Task::Kind::probe || !open_ || now - last_good_ > kChannelTrust) {
    // Presence is proven without the password as well, if worse: its reply equals its echo.
    if (!MayOpen(now)) return Make(kLinkOnly);
    Bytes open = {kOpenChannel};
    Append(open, settings_.password);
    Request request = Make(open);
    request.distinct = true;  // answered by a status; "00" answers nothing else
    // A meter that answers too late must not get a wrong password three times.
    request.expect.repeatable = accepted_;
    return request;
  }
  if (settings_.serial_number && !verified_) return Make(kAskSerial);
  const Bytes pdu = fields_.PduOf(plan_, task.query);
  if (!asked_variant_ && NeedsConstants(pdu, LacksVariant)) return Make(kAskVariant);
  if (!asked_ratios_ && NeedsConstants(pdu, LacksRatios)) return Make(kAskRatios);
  if (!IsSnapshot(pdu)) return Make(pdu);
  // The meter repeats the id: a late reply to the snapshot before this one is found out.
  Bytes tagged = pdu;
  tagged[2] = ++snapshot_id_;
  return Make(tagged);
}

bool MeterConversation::Accepts(View asked, View answering) const {
  if (std::ranges::equal(asked, answering)) return true;
  if (asked.size() != 1) return false;
  if (answering.size() == 1) return asked[0] == kCommonAddress;
  return settings_.serial_number &&
         std::ranges::equal(answering, ExtendedAddress(*settings_.serial_number));
}

MeterConversation::Reply MeterConversation::Decode(View request, View frame) const {
  Reply reply;
  const auto unexpected = [&reply](std::string why) {
    reply.answer.outcome = Outcome::unexpected;
    reply.answer.reason = std::move(why);
    return reply;
  };
  const auto asked = SplitFrame(request);
  if (!asked) return unexpected("the request is not a SET-4TM frame with a good checksum");
  const auto got = SplitFrame(frame);
  if (!got) {
    reply.answer.outcome = Outcome::corrupt;
    reply.answer.reason = "the reply is not a SET-4TM frame with a good checksum";
    return reply;
  }
  if (!Accepts(asked->address, got->address)) {
    const bool extended = got->address.size() > 1 && asked->address.size() == 1;
    return unexpected("reply of meter " + ToHex(got->address) + ", not " + ToHex(asked->address) +
                      (extended ? "; if it is the right one, set `serial_number`" : ""));
  }
  const View pdu = asked->body;
  // A float read and its reply are equally long; only the link test is answered by its own bytes.
  if (pdu[0] != kLinkTest && std::ranges::equal(request, frame)) {
    return unexpected("the request came back; does the adapter echo? set `echo: strip`");
  }
  if (got->body.size() == 1) {
    reply.pdu = pdu;
    reply.status = got->body[0];
    ReadStatus(reply);
    return reply;
  }
  const bool fits = fields_.Matches(pdu).empty() ? MayAnswer(pdu, got->body.size())
                                                 : LengthOfData(pdu) == got->body.size();
  if (AnsweredByStatus(pdu) || !fits) {
    return unexpected(std::to_string(got->body.size()) + " data bytes do not answer request " +
                      HexByte(pdu[0]));
  }
  if (IsSnapshot(pdu) && got->body[0] != pdu[2]) {
    return unexpected("reply to another snapshot: id " + HexByte(got->body[0]));
  }
  reply.pdu = pdu;
  reply.data = got->body;
  ReadData(reply);
  return reply;
}

void MeterConversation::ReadStatus(Reply& reply) const {
  const bool awaited = AnsweredByStatus(reply.pdu);
  StatusMeaning meaning = Explain(*reply.status, reply.pdu[0] == kOpenChannel);
  reply.answer.wait = meaning.wait;
  if (meaning.outcome == Outcome::ok && !awaited) {
    reply.answer.outcome = Outcome::unexpected;
    reply.answer.reason = "status 00 where data was asked for";
    return;
  }
  reply.answer.outcome = meaning.outcome;
  reply.answer.reason = std::move(meaning.reason);
  if (!meaning.quality || awaited) return;
  const auto matches = fields_.Matches(reply.pdu);
  for (const Match& match : matches) {
    reply.answer.readings.push_back({match.point, {}, *meaning.quality, {}});
  }
  if (!matches.empty()) return;
  reply.answer.readings.push_back({kNoPoint, {}, *meaning.quality, ToHex(reply.pdu)});
}

void MeterConversation::ReadData(Reply& reply) const {
  const Scale known = scale();
  const auto matches = fields_.Matches(reply.pdu);
  for (const Match& match : matches) {
    Decoded decoded = DecodeField(match.field, reply.data, known);
    reply.answer.readings.push_back({match.point, std::move(decoded.value), decoded.quality, {}});
  }
  if (matches.empty()) reply.answer.readings = ReadPrinted(reply.pdu, reply.data, known);
}

void MeterConversation::Learn(View pdu, View data) {
  if (Is(pdu, kAskVariant)) {
    const Scale variant = ParseVariant(data);
    learned_.meter_constant = variant.meter_constant;
    learned_.power_coefficient = variant.power_coefficient;
    learned_.current_coefficient = variant.current_coefficient;
    asked_variant_ = true;
  } else if (Is(pdu, kAskRatios)) {
    const Scale ratios = ParseRatios(data);
    learned_.voltage_ratio = ratios.voltage_ratio;
    learned_.current_ratio = ratios.current_ratio;
    asked_ratios_ = true;
  }
}

/// CRC-16 has no final XOR: before a zero, C8 03 09 30 C8 (two bytes of data) is a good frame of
/// three as well, C8 03 09 30 C8 00. Whether one follows is not known here, so it may answer
/// either.
Outcome MeterConversation::Check(View request, View frame) const {
  const Outcome outcome = Decode(request, frame).answer.outcome;
  if (outcome != Outcome::unexpected) return outcome;
  Bytes longer(frame.begin(), frame.end());
  longer.push_back(0);
  return Decode(request, longer).answer.outcome;
}

Answer MeterConversation::Interpret(View request, View frame) {
  Reply reply = Decode(request, frame);
  if (!reply.data.empty()) Learn(reply.pdu, reply.data);
  return std::move(reply.answer);
}

Answer MeterConversation::End(Answer answer) {
  reopened_ = repeated_ = 0;
  return answer;
}

Answer MeterConversation::OnFrame(const Task& task, const Request& request, View frame,
                                  Instant now) {
  Reply reply = Decode(request.bytes, frame);
  if (reply.pdu.empty()) return End(std::move(reply.answer));
  if (reply.status) return AfterStatus(task, std::move(reply), now);
  last_good_ = now;
  Learn(reply.pdu, reply.data);
  if (settings_.serial_number && Is(reply.pdu, kAskSerial)) {
    verified_ = ByteReader(reply.data).U32Be(0) == *settings_.serial_number;
    if (!verified_) return End(Mismatch(reply.data));
    if (trouble_.reason == Reason::swapped) trouble_ = {};
  }
  const bool own = task.kind == Task::Kind::poll;
  const Bytes wanted = own ? fields_.PduOf(plan_, task.query) : kAskSerial;
  if (own && !Is(reply.pdu, wanted) && !(IsSnapshot(reply.pdu) && IsSnapshot(wanted))) {
    reply.answer.then = Then::ask_again;
    return std::move(reply.answer);
  }
  return End(std::move(reply.answer));
}

Answer MeterConversation::Mismatch(View data) {
  Answer answer;
  answer.outcome = Outcome::refused;
  answer.wait = 1min;
  answer.reason = "meter " + std::to_string(ByteReader(data).U32Be(0).value_or(0)) +
                  " answers in place of " + std::to_string(settings_.serial_number.value_or(0)) +
                  "; correct `serial_number` or the address";
  trouble_ = {Reason::swapped, answer.reason};
  return answer;
}

bool MeterConversation::MayOpen(Instant now) const {
  if (refused_at_.empty()) return true;
  return refused_at_.size() < kMostTries && now - refused_at_.front() >= kSecondTry;
}

Answer MeterConversation::PasswordRefused(Answer answer, Instant now) {
  if (MayOpen(now)) refused_at_.push_back(now);
  const bool last = refused_at_.size() >= kMostTries;
  answer.wait = last ? kSecondTry : refused_at_.front() + kSecondTry - now;
  answer.outcome = Outcome::refused;
  answer.reason = std::string("the meter refuses the password; set `password`; ") +
                  (last ? "it is not tried again before 'baudgate enable'" : "tried again in 1 h");
  trouble_ = {Reason::password_refused, answer.reason};
  return answer;
}

Answer MeterConversation::AfterOpen(const Task& task, Reply reply, Instant now) {
  open_ = CodeOf(*reply.status) == kOk;
  if (!open_) {
    const bool refused = CodeOf(*reply.status) == kLevelTooLow;
    return End(refused ? PasswordRefused(std::move(reply.answer), now) : std::move(reply.answer));
  }
  accepted_ = true;
  refused_at_.clear();
  if (trouble_.reason == Reason::password_refused) trouble_ = {};
  last_good_ = now;
  verified_ = false;  // another meter may have taken the address
  if (task.kind == Task::Kind::probe) return End(std::move(reply.answer));
  reply.answer.then = Then::ask_again;
  return std::move(reply.answer);
}

Answer MeterConversation::AfterClosed(Answer answer) {
  open_ = false;
  if (reopened_ >= kReopens) return End(std::move(answer));
  ++reopened_;
  return AskAgain();
}

Answer MeterConversation::AfterStatus(const Task& task, Reply reply, Instant now) {
  if (reply.pdu[0] == kOpenChannel) return AfterOpen(task, std::move(reply), now);
  if (reply.pdu[0] == kLinkTest && task.kind != Task::Kind::probe) {
    return PasswordRefused(std::move(reply.answer), now);
  }
  switch (CodeOf(*reply.status)) {
    case kChannelClosed:
      return AfterClosed(std::move(reply.answer));
    case kRepeat:
      if (repeated_ >= kRepeats) return End(std::move(reply.answer));
      ++repeated_;
      return AskAgain();
    case kNotAllowed:
    case kLevelTooLow:
      break;
    default:
      return End(std::move(reply.answer));
  }
  last_good_ = now;
  const bool own = task.kind == Task::Kind::poll;
  if (own && IsSnapshot(reply.pdu)) {
    // Older firmware: go back to 08 1B, the points are not to blame.
    snapshot_ = false;
    plan_ = fields_.MakePlan(snapshot_);
    reply.answer.readings.clear();
  } else if (own && Is(reply.pdu, fields_.PduOf(plan_, task.query))) {
    plan_.OnRefused(task.query);
  } else if (Is(reply.pdu, kAskVariant) || Is(reply.pdu, kAskRatios)) {
    // Only the scaled values of the query suffer; the options can give what the meter does not.
    (Is(reply.pdu, kAskVariant) ? asked_variant_ : asked_ratios_) = true;
    return AskAgain();
  } else {
    return End(std::move(reply.answer));
  }
  reply.answer.then = Then::replan;
  return End(std::move(reply.answer));
}

Then MeterConversation::OnFailure(const Task&, const Request& request, Outcome outcome,
                                  Instant now) {
  const auto asked = SplitFrame(request.bytes);
  const bool opening = asked && asked->body[0] == kOpenChannel;
  if (opening) open_ = false;
  // It has refused before, and has answered something now: that counts, or each query would try.
  if (opening && outcome == Outcome::unexpected && trouble_.reason == Reason::password_refused) {
    refused_at_.push_back(now);
  }
  verified_ = false;
  reopened_ = repeated_ = 0;
  return Then::done;
}

}  // namespace baudgate::protocols::set4tm
