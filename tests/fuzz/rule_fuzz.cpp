// Fuzzes the frame rules and checks their laws: every cut lies within the held bytes; bytes in =
// delivered + discarded + held; memory is bounded; the frames do not depend on how the bytes are
// fragmented. Input: options; for replies a length byte and the request; then pieces
// (tests/fuzz/stream.h).
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "protocols/assembler.h"
#include "tests/fuzz/stream.h"
#include "tests/fuzz/under_test.h"

namespace baudgate::fuzz {
namespace {

/// Checks the laws of a rule directly, because the assembler tolerates some violations.
template <protocols::FrameRule protocols::Protocol::*kRule>
protocols::Cut CheckedRule(View held, const protocols::Expectation& expect, bool idle) {
  const protocols::Cut cut = (UnderTest().*kRule)(held, expect, idle);
  const protocols::Cut again = (UnderTest().*kRule)(held, expect, idle);
  Require(cut.kind == again.kind && cut.size == again.size && cut.blame == again.blame,
          "the same slice gets the same answer");
  Require(cut.size <= held.size(), "a cut is no longer than what is held");
  if (cut.kind == protocols::Cut::Kind::need_more) return cut;
  Require(cut.size >= 1, "every answer but need_more consumes");
  if (cut.kind == protocols::Cut::Kind::frame) {
    Require(cut.size <= expect.max_bytes, "a frame is no longer than max_bytes");
    return cut;
  }
  Require(!cut.why.empty(), "a discard says why");
  Require(cut.blame == Outcome::none || cut.blame == Outcome::partial ||
              cut.blame == Outcome::unexpected || cut.blame == Outcome::corrupt,
          "a discard is corrupt, unexpected, partial or harmless");
  return cut;
}

struct Delivery {
  std::vector<std::size_t> ends;
  std::vector<Bytes> frames;
  std::uint64_t discarded = 0;
  Outcome blame = Outcome::none;

  bool operator==(const Delivery&) const = default;
};

void TakeFrames(protocols::Assembler& assembler, bool idle, Delivery& delivery) {
  while (auto frame = assembler.Next(idle)) {
    const protocols::AssemblerCounters& count = assembler.counters();
    delivery.ends.push_back(static_cast<std::size_t>(count.delivered + count.discarded));
    delivery.frames.push_back(std::move(*frame));
  }
}

Delivery Deliver(protocols::FrameRule rule, View stream, const std::vector<std::size_t>& cuts,
                 const protocols::Expectation& expect) {
  Delivery delivery;
  protocols::Assembler assembler;
  assembler.Begin(rule, expect);
  std::size_t from = 0;
  const auto feed = [&](std::size_t to) {
    assembler.Feed(stream.subspan(from, to - from));
    from = to;
    TakeFrames(assembler, false, delivery);
    Require(assembler.held() <= expect.max_bytes, "memory is bounded by max_bytes");
  };
  for (const std::size_t cut : cuts) feed(cut);
  feed(stream.size());
  TakeFrames(assembler, true, delivery);
  const protocols::AssemblerCounters& count = assembler.counters();
  Require(count.in == stream.size(), "all bytes are counted");
  Require(count.in == count.delivered + count.discarded + assembler.held(),
          "bytes in = delivered + discarded + held");
  Require(assembler.held() == 0, "nothing is held after silence");
  delivery.discarded = count.discarded;
  delivery.blame = assembler.blame();
  return delivery;
}

template <bool kReplies>
void FuzzRule(View bytes) {
  Input input(bytes);
  const protocols::ParsedOptions& options = CachedOptions(input.U8());
  const View request = kReplies ? input.TakeCounted() : View();
  const protocols::Expectation expect = UnderTest().expect(request, options);
  Require(expect.max_bytes > 0 && expect.max_bytes <= 8192, "max_bytes bounds every buffer");
  for (const auto& [at, count] : expect.secrets) {
    Require(at <= request.size() && count <= request.size() - at, "secrets lie in the request");
  }
  const Stream stream = TakeStream(UnderTest(), input);
  const protocols::FrameRule rule = kReplies ? CheckedRule<&protocols::Protocol::reply_rule>
                                             : CheckedRule<&protocols::Protocol::request_rule>;
  const Delivery pieces = Deliver(rule, stream.bytes, stream.cuts, expect);
  if (!stream.cuts.empty()) {
    const Delivery whole = Deliver(rule, stream.bytes, {}, expect);
    Require(whole.frames == pieces.frames && whole.ends == pieces.ends,
            "any fragmentation gives the same frames");
    Require(whole.discarded == pieces.discarded, "any fragmentation discards the same bytes");
    // `blame` is the outcome that discarded bytes give their exchange. Bytes before a request
    // belong to no exchange, so their blame does not matter.
    Require(!kReplies || whole.blame == pieces.blame, "any fragmentation gives the same blame");
  }
}

const RegisteredFor kRequests(Protocols::all, "rule_", "_request", FuzzRule<false>);
const RegisteredFor kReplies(Protocols::all, "rule_", "_reply", FuzzRule<true>);

}  // namespace
}  // namespace baudgate::fuzz
