// Cuts SPA messages from `>` or `<` to CR.
//
//   > 3E 31 52 46 3A 32 31 0D                        >1RF:21           what is slave 1?
//   < 0A 3C 31 44 3A 30 2E 35 32 2F 31 3A 36 30 0D 0A
//                                                    <1D:0.52/1:60     two values
//   < 0A 3C 31 41 3A 37 36 0D 0A                     <1A:76            a write is acknowledged
//   < 0A 3C 31 4E 3A 35 3A 37 36 0D 0A               <1N:5:76          refused, code 5
//   < 0A 3C 33 44 3A 31 2E 30 30 26 0D 0A 30 2F ... 3A CC CC 0D 0A     continued behind & CR LF
//
// `<` and `>` never stand inside a message: one that appears cuts off what came before it. Fibre
// rings bring every request back to the master.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/frame_rule.h"

#include <string>

#include "protocols/common/frame_cuts.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {
namespace {

/// How far a message could be followed from its first byte.
struct Scan {
  enum class State { open, broken, whole } state = State::open;
  std::size_t size = 0;  ///< whole: up to and with its CR; broken: the bytes that are no message
  std::string_view why;
};

/// Follows text from its start character to the CR that ends it.
Scan ScanText(View held, bool may_continue) {
  std::size_t line_start = 0;
  std::size_t lines = 1;
  for (std::size_t i = 1; i < held.size(); ++i) {
    const std::uint8_t byte = held[i];
    const bool after_ampersand = may_continue && held[i - 1] == '&';
    if (byte == kCr) {
      if (!after_ampersand) return {Scan::State::whole, i + 1, {}};
      if (i + 1 == held.size()) return {};
      if (held[i + 1] != kLf) return {Scan::State::broken, i + 1, "no LF behind & CR"};
      if (++lines > kMaxLines) return {Scan::State::broken, i + 1, "more than 16 lines"};
      line_start = ++i + 1;
    } else if (byte == '<' || byte == '>') {
      return {Scan::State::broken, i, "cut short by another message"};
    } else if (!IsPrintable(byte)) {
      return {Scan::State::broken, i, "a character that the bus does not have"};
    } else if (after_ampersand) {
      return {Scan::State::broken, i, "& inside a line"};
    } else if (i - line_start >= kLongestLine) {
      return {Scan::State::broken, i, "line of more than 256 characters"};
    }
  }
  return {};
}

/// Up to the next message, or to the line end of the one before, which is no noise.
Cut SkipTo(View held, std::string_view starts) { return cut::SkipNoise(held, starts, "\r\n"); }

/// What a fibre ring brings back.
Cut SkipEcho(View held, bool idle) {
  constexpr std::string_view kWhy = "echo of a request";
  const Scan scan = ScanText(held, false);
  if (scan.state != Scan::State::open) return Cut::Discard(scan.size, Outcome::none, kWhy);
  return idle ? Cut::Discard(held.size(), Outcome::none, kWhy) : Cut::NeedMore();
}

}  // namespace

// < 3C 32 44 3A 30 3A 37 41 0D 0A: <2D:0:7A while slave 1 is asked is passed over.
Cut ReplyRule(View held, const Expectation& expect, bool idle) {
  if (held[0] == '>') return SkipEcho(held, idle);
  if (held[0] != '<') return SkipTo(held, "<>");
  const Scan scan = ScanText(held, true);
  if (scan.state == Scan::State::open) return Cut::NeedMore();
  if (scan.state == Scan::State::broken) {
    return Cut::Discard(scan.size, Outcome::corrupt, scan.why);
  }
  const View text = held.first(scan.size);
  if (scan.size >= expect.max_bytes) {
    return cut::TooLong(scan.size);
  }
  const auto reply = ParseReply(text);
  if (!reply) return Cut::Discard(scan.size, Outcome::corrupt, "syntax");
  if (!ChecksumPasses(text, expect.checksum)) {
    return cut::BadChecksum(scan.size);
  }
  if (!expect.address.empty() && std::to_string(reply->slave) != AsText(expect.address)) {
    return cut::OfAnother(scan.size);
  }
  // The LF belongs to the frame, or it would be a stray byte of the next exchange; a slave that
  // leaves it out is understood as well.
  if (scan.size == held.size()) return idle ? Cut::Frame(scan.size) : Cut::NeedMore();
  return Cut::Frame(held[scan.size] == kLf ? scan.size + 1 : scan.size);
}

Cut RequestRule(View held, const Expectation& expect, bool) {
  if (held[0] != '>') return SkipTo(held, ">");
  const Scan scan = ScanText(held, false);
  if (scan.state == Scan::State::open) return Cut::NeedMore();
  if (scan.state == Scan::State::broken) {
    return Cut::Discard(scan.size, Outcome::corrupt, scan.why);
  }
  if (scan.size > expect.max_bytes) {
    return cut::TooLong(scan.size);
  }
  return Cut::Frame(scan.size);
}

}  // namespace baudgate::protocols::spabus
