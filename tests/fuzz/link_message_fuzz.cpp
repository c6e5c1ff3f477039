// Fuzzes the messages between daemon and DDS process. Each is refused with a reason, or gives the
// same bytes when encoded again.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/link_message.h"
#include "gateway/outputs/dds/published_types.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

using namespace dds;

bool Same(View a, View b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

template <typename Sample>
void CheckSample(const LinkMessage& message) {
  Sample sample;
  if (!Decode(message.body, sample)) return;
  Bytes packet(kMaxLinkMessage);
  packet.resize(EncodeSample(message.kind, sample, packet));
  const auto again = ParseLink(packet);
  Require(again.ok() && again->kind == message.kind, "a sample that was read can be sent on");
  Sample back;
  Require(Decode(again->body, back), "what was sent on can be read");
  // The encodings are compared, not the values, because NaN is not equal to NaN.
  Bytes second(kMaxLinkMessage);
  second.resize(EncodeSample(message.kind, back, second));
  Require(Same(packet, second), "and says the same");
}

void CheckPacket(View packet) {
  const auto message = ParseLink(packet);
  if (!message.ok()) {
    Require(!message.error().empty(), "a refused packet has a reason");
    return;
  }
  Require(message->body.size() + kLinkHeaderBytes == packet.size(), "the length is the packet's");
  switch (message->kind) {
    case LinkKind::open: {
      const auto open = DecodeOpen(message->body);
      if (open.ok()) Require(Same(EncodeOpen(*open), packet), "open has one form");
      break;
    }
    case LinkKind::counts: {
      const auto counts = DecodeCounts(message->body);
      if (counts.ok()) Require(Same(EncodeCounts(*counts), packet), "counts have one form");
      break;
    }
    case LinkKind::failed:
      Require(DecodeFailed(message->body).size() <= 1000, "a sentence is bounded");
      break;
    case LinkKind::point:
      CheckSample<PointSample>(*message);
      break;
    case LinkKind::device:
      CheckSample<DeviceSample>(*message);
      break;
    case LinkKind::gateway:
      CheckSample<GatewaySample>(*message);
      break;
    case LinkKind::event:
      CheckSample<EventSample>(*message);
      break;
    case LinkKind::alarm:
      CheckSample<AlarmSample>(*message);
      break;
    case LinkKind::reply:
      CheckSample<ReplySample>(*message);
      break;
    case LinkKind::request: {
      const auto request = DecodeRequest(message->body);
      if (!request.ok()) break;
      const Bytes again = EncodeRequest(*request);
      const auto back = DecodeRequest(ParseLink(again)->body);
      Require(back.ok() && EncodeRequest(*back) == again, "a request has one meaning");
      break;
    }
    case LinkKind::end:
    case LinkKind::opened:
    case LinkKind::left:
      break;
  }
}

void FuzzLinkMessage(View bytes) {
  const Bytes packet(bytes.begin(), bytes.end());
  CheckPacket(packet);
}

const Registered kLinkMessage("link_message", FuzzLinkMessage);

}  // namespace
}  // namespace baudgate::fuzz
