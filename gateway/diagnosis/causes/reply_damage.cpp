// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "gateway/diagnosis/causes/hypotheses.h"

namespace baudgate::control {
namespace {

using enum Symptom;

/// A converter takes no more single bytes out of a reply.
constexpr std::size_t kMissing = 4;
/// Fewer may be noise.
constexpr std::size_t kFewLosses = 3;
/// No buffer is as small.
constexpr std::size_t kNoBuffer = 16;

/// A reply of which two bytes are lost may look like one that breaks off before its check value.
bool LacksBytes(const Evidence& evidence) {
  return !evidence.answered && evidence.Count(bytes_lost) >= kMany;
}

/// Replies up to a length are right, and those beyond it never.
bool OnlyLong(const Evidence& evidence,
              const ReplyLengths::TooLong& (ReplyLengths::*which)() const) {
  // One that has died has answered the short ones as well, once.
  if (evidence.device == nullptr || evidence.absent) return false;
  if (!evidence.traits().has_blocks) return false;
  const Findings& findings = evidence.device->status.findings;
  if (findings.Runs() < kFacts || findings.lengths().longest_good() == 0) return false;
  const ReplyLengths::TooLong& bad = (findings.lengths().*which)();
  return bad.count >= kFacts && bad.shortest > kNoBuffer &&
         4 * bad.shortest > 5 * findings.lengths().longest_good();
}

}  // namespace

/// A reply that lacks two characters may look whole but for its check value.
bool LosesAnywhere(const Evidence& evidence) {
  if (!evidence.traits().speaks_text) return false;
  if (evidence.Count({damaged, noise, zeros, bytes_added}) > 0) return false;
  if (evidence.Count(other_setting) >= evidence.Count(bytes_lost)) return false;
  const auto plain = [&](Symptom symptom) {
    return evidence.Last(symptom).cause == kGarbled ? 0 : evidence.Count(symptom);
  };
  const std::size_t lost = evidence.Count(bytes_lost) + plain(head_lost) + plain(end_lost);
  return evidence.answered && evidence.Count(bytes_lost) > 0 && lost >= kFewLosses &&
         3 * lost >= evidence.seen;
}

/// All that failed had a byte which converters change, and nothing good had.
double NotTransparent(const Evidence& evidence) {
  if (evidence.device == nullptr || !evidence.answered) return 0;
  // Good messages that come unasked are not looked at.
  if (evidence.device->status.unasked) return 0;
  if (evidence.seen < kFacts || Suspects(evidence) == 0) return 0;
  // A reply that breaks off long before its end lacks more than one such byte.
  const Finding& cut = evidence.Last(tail_lost);
  const bool breaks_off =
      cut.expected > cut.bytes + kMissing && 2 * evidence.Count(tail_lost) > evidence.seen;
  if (breaks_off) return 0;
  return evidence.Share({damaged, noise, bad_check, bytes_lost, bytes_added, tail_lost});
}

/// Where others are read well, that of one is damage.
double EighthBit(const Evidence& evidence) {
  return evidence.answered && !evidence.changed ? 0 : evidence.Share({eighth_bit});
}

double BadCheck(const Evidence& evidence) {
  if (IsComputedOtherwise(evidence)) return evidence.Share({bad_check, damaged, noise});
  return evidence.answered ? 0 : evidence.Share({bad_check});
}

/// A reply that lacks more of its beginning looks like noise.
double HeadLost(const Evidence& evidence) {
  if (evidence.Count(head_lost) < kFewLosses) return evidence.Share({head_lost});
  return evidence.Share({head_lost}, {noise, zeros, damaged}, 2);
}

/// Noise changes characters, and takes none away; two devices that answer at once do both.
double BytesLost(const Evidence& evidence) {
  if (LosesAnywhere(evidence)) {
    return evidence.Share({bytes_lost, bad_check, head_lost, tail_lost, end_lost, other_setting});
  }
  const bool some = 3 * evidence.Count(bytes_lost) >= 2 * evidence.seen || LacksBytes(evidence);
  if (!some) return Always<bytes_lost>(evidence);
  return evidence.Share({bytes_lost, bad_check, damaged, tail_lost, end_lost});
}

/// Beside good replies a wrong last byte is damage like any other, unless nothing else is damaged.
double EndLost(const Evidence& evidence) {
  const bool only = evidence.Count(end_lost) >= kMany && evidence.Share({end_lost}) > 0.9;
  if (evidence.answered && !evidence.Last(end_lost).cause.empty() && !only) return 0;
  return Always<end_lost>(evidence);
}

/// A buffer that is too small may leave a reply that lacks its last byte alone.
double BreaksOff(const Evidence& evidence) {
  if (evidence.Count(tail_lost) == 0) return 0;
  const double share = LacksBytes(evidence) ? 0 : evidence.Share({tail_lost, end_lost, bytes_lost});
  return evidence.answered && share < 0.6 ? 0 : share;
}

/// Not a character of the other parity came.
double OtherParity(const Evidence& evidence) {
  if (evidence.seen < kMany || !OnWire(evidence)) return 0;
  const bool network = evidence.line->is_network();
  if (network && evidence.answered) return 0;
  const bool all = std::ranges::all_of(evidence.records, [network](const DeviceRecord* record) {
    const SpecialBytes& specials = record->status.findings.specials();
    return network ? specials.LacksOneParity() : specials.IsOneParity();
  });
  if (!all) return 0;
  return evidence.Share({bad_check, damaged, noise, bytes_lost, tail_lost, end_lost, head_lost});
}

/// Its replies, each without the eighth bits.
double SevenBits(const Evidence& evidence) {
  if (evidence.seen < kMany || !OnWire(evidence)) return 0;
  const bool all = std::ranges::all_of(evidence.records, [](const DeviceRecord* record) {
    return record->status.findings.specials().IsSevenBit();
  });
  return all ? evidence.Share({bad_check, damaged}) : 0;
}

double TooLong(const Evidence& evidence) {
  return OnlyLong(evidence, &ReplyLengths::silent) ? evidence.Share({silence}) : 0;
}

double LongDamaged(const Evidence& evidence) {
  if (!OnlyLong(evidence, &ReplyLengths::damaged) || evidence.Count(split) > 0) return 0;
  return evidence.Share({damaged, noise, bad_check, bytes_lost, tail_lost, end_lost});
}

}  // namespace baudgate::control
