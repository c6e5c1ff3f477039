// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/point_reads.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/latch.h"
#include "protocols/set4tm/meter/printed.h"
#include "protocols/set4tm/meter/status.h"
#include "protocols/set4tm/meter/values.h"

namespace baudgate::protocols::set4tm {
namespace {

/// True if `body` looks like a request of another master to the same meter. It can be as long as
/// the reply, and its check value is correct, too.
///
///   > 14 08 1B 00 11    a float       < 14 08 1B 00 41    another master asks for the frequency
bool IsQuestionLike(View pdu, View body) {
  constexpr std::uint8_t kLastWay = 0x03;  // ways of reading floats: single, latched, group, both
  if (pdu.size() < 3 || body.size() != pdu.size()) return false;
  if (body[0] != pdu[0] || body[1] != pdu[1]) return false;
  if (body.size() > 3) return body[2] <= kLastWay;
  // The third byte of a request is a parameter, with the phase in its low two bits. Any other byte
  // may be the last byte of an integer reply.
  return body[2] < 0x80 && (body[2] & 0x0CU) == 0;
}

}  // namespace

bool ReplyReader::Accepts(View asked, View answering) const {
  if (std::ranges::equal(asked, answering)) return true;
  if (asked.size() != 1) return false;
  if (answering.size() == 1) return asked[0] == kCommonAddress;
  return settings_.serial_number &&
         std::ranges::equal(answering, ExtendedAddress(*settings_.serial_number));
}

Reply ReplyReader::Read(View request, View frame) const {
  Reply reply;
  const auto unexpected = [&reply](std::string why) {
    reply.answer.outcome = Outcome::unexpected;
    reply.answer.reason = std::move(why);
    return reply;
  };
  const auto asked = SplitFrame(request, settings_.checksum);
  if (!asked) return unexpected("the request is not a SET-4TM frame with a good checksum");
  const auto got = SplitFrame(frame, settings_.checksum);
  if (!got) {
    reply.answer.outcome = Outcome::corrupt;
    reply.answer.reason = "the reply is not a SET-4TM frame with a good checksum";
    return reply;
  }
  if (!Accepts(asked->address, got->address)) {
    const bool extended = got->address.size() > 1 && asked->address.size() == 1;
    return unexpected("the reply is from meter " + ToHex(got->address) + ", not " +
                      ToHex(asked->address) +
                      (extended ? "; if this is the right meter, set `serial_number`" : ""));
  }
  const View pdu = asked->body;
  // A reply that equals its request is an echo: the request for a float is as long as its reply.
  // Only the reply to a link test equals its request.
  if (pdu[0] != kLinkTest && std::ranges::equal(request, frame)) {
    return unexpected(
        "the request came back; if the adapter returns sent bytes, set `echo: strip`");
  }
  if (IsQuestionLike(pdu, got->body)) {
    return unexpected(
        "a request came instead of a reply: another master asks this meter; remove the other "
        "master");
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
    reply.answer.remedy = "check whether the profile fits this type of meter";
    return unexpected(std::to_string(got->body.size()) +
                      " data bytes came, which does not fit request " + HexByte(pdu[0]));
  }
  if (IsMasked(pdu) && got->body[0] != pdu[2]) {
    return unexpected("the reply is to another snapshot (08 23): id " + HexByte(got->body[0]));
  }
  if (pdu[0] == kMemoryTagged && got->body[0] != pdu[1]) {
    return unexpected("the reply is to another read of memory: id " + HexByte(got->body[0]));
  }
  reply.pdu = pdu;
  reply.data = got->body;
  ReadData(reply);
  return reply;
}

void ReplyReader::ReadStatus(Reply& reply) const {
  const bool awaited = AnsweredByStatus(reply.pdu);
  StatusMeaning meaning = Explain(*reply.status, reply.pdu[0] == kOpenChannel);
  reply.answer.wait = meaning.wait;
  if (meaning.outcome == Outcome::ok && !awaited) {
    reply.answer.outcome = Outcome::unexpected;
    reply.answer.reason = "the meter answers with status 00 (done) instead of data";
    return;
  }
  reply.answer.outcome = meaning.outcome;
  reply.answer.reason = std::move(meaning.reason);
  reply.answer.remedy = meaning.remedy;
  if (!meaning.quality || awaited) return;
  const auto matches = fields_.Matches(reply.pdu);
  for (const Match& match : matches) {
    reply.answer.readings.push_back({match.point, {}, *meaning.quality, {}});
  }
  if (!matches.empty()) return;
  reply.answer.readings.push_back({kNoPoint, {}, *meaning.quality, ToHex(reply.pdu)});
}

void ReplyReader::ReadData(Reply& reply) const {
  const Scale known = identification_.scale();
  const auto matches = fields_.Matches(reply.pdu);
  for (const Match& match : matches) {
    Decoded decoded = DecodeField(match.field, reply.data, known);
    // If the type is unknown, the table of another type would give the bit a wrong name.
    if (IsFlag(match.field) && !identification_.KnowsStatusWord()) {
      decoded = {{}, {Quality::bad_configuration, Reason::not_fitted}};
    }
    reply.answer.readings.push_back({match.point, std::move(decoded.value), decoded.quality, {}});
  }
  if (matches.empty()) reply.answer.readings = ReadPrinted(reply.pdu, reply.data, known);
}

/// Returns the outcome of a reply. CRC-16 has no final XOR, so a zero after a good frame gives a
/// good frame again: C8 03 09 30 C8 has two data bytes, and C8 03 09 30 C8 00 has three. A zero may
/// still follow `frame`, so the frame is accepted if it fits with or without one more zero.
Outcome ReplyReader::Check(View request, View frame) const {
  const Outcome outcome = Read(request, frame).answer.outcome;
  if (outcome != Outcome::unexpected) return outcome;
  Bytes longer(frame.begin(), frame.end());
  longer.push_back(0);
  return Read(request, longer).answer.outcome;
}

PointReads::PointReads(const config::Device& device, const Settings& settings,
                       const Identification& identification)
    : settings_(settings),
      identification_(identification),
      fields_(device.points),
      is_often_(OftenOf(device)),
      plan_(fields_.MakePlan(false, is_often_)) {}

void PointReads::OnReconnect() {
  integers_ = false;
  fields_.UseIntegers(false);
  UseMasks(settings_.snapshot == Snapshot::on);
  TryMasks();
}

bool PointReads::MasksMayHelp() const {
  if (masked_ || settings_.snapshot == Snapshot::off) return false;
  return fields_.MakePlan(true).queries().size() < plan_.queries().size();
}

void PointReads::UseMasks(bool masked) {
  masked_ = masked;
  tries_masks_ = false;
  PduPlan plan = fields_.MakePlan(masked, is_often_);
  plan.TakeProven(plan_);
  plan_ = std::move(plan);
}

bool PointReads::ChooseIntegers() {
  const bool integers = identification_.floats() == Knows::no && !identification_.trouble();
  if (integers == integers_ || !(integers_ || fields_.HasFloats())) return false;
  integers_ = integers;
  fields_.UseIntegers(integers);
  UseMasks(!integers && settings_.snapshot == Snapshot::on);
  tries_masks_ = !integers && MasksMayHelp();
  return true;
}

std::optional<Bytes> PointReads::Trial(std::size_t query) const {
  if (!tries_masks_ || identification_.masked_floats() == Knows::no) return std::nullopt;
  if (!IsFloatRead(fields_.PduOf(plan_, query))) return std::nullopt;
  const std::size_t point = plan_.queries()[query].points.front();
  const PduPlan masked = fields_.MakePlan(true);
  for (std::size_t i = 0; i < masked.queries().size(); ++i) {
    if (std::ranges::count(masked.queries()[i].points, point) == 0) continue;
    Bytes pdu = fields_.PduOf(masked, i);
    return IsMasked(pdu) ? std::optional(std::move(pdu)) : std::nullopt;
  }
  return std::nullopt;
}

PointReads::Read PointReads::ReadOf(std::size_t query) const {
  if (auto trial = Trial(query)) return {.pdu = std::move(*trial), .tries_masks = true};
  return {.pdu = fields_.PduOf(plan_, query)};
}

void PointReads::Number(Bytes& pdu) {
  if (IsMasked(pdu)) pdu[2] = ++number_;
}

bool PointReads::Reads(View pdu, std::size_t query) const {
  const Bytes own = fields_.PduOf(plan_, query);
  return Is(pdu, own) || (IsMasked(pdu) && IsMasked(own));
}

bool PointReads::ReadsLatched(std::size_t query) const {
  return set4tm::ReadsLatched(fields_.PduOf(plan_, query));
}

/// Takes the reply to the trial of a masked read. If a value in it is not good, the points are read
/// by 08 1B, which may return the value.
Answer PointReads::TakeTrial(Answer answer) {
  const bool whole = std::ranges::all_of(
      answer.readings, [](const Reading& reading) { return IsGood(reading.quality); });
  tries_masks_ = false;
  if (!whole) return AskAgain();
  UseMasks(true);
  answer.then = Then::restart;
  return answer;
}

bool PointReads::ForgetRefusals() {
  TryMasks();
  return plan_.ForgetRefusals();
}

std::string PointReads::Learned() const {
  if (masked_) return "floats are read together (08 23)";
  return integers_ ? "integers are read, because this type of meter does not support floats" : "";
}

}  // namespace baudgate::protocols::set4tm
