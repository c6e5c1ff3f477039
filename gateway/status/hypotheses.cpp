// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/hypotheses.h"

#include <algorithm>
#include <utility>

#include "gateway/status/hypothesis_words.h"

namespace baudgate::control {
namespace {

using enum Symptom;

/// What a hypothesis leaves unexplained, from which another one is said as well.
constexpr double kUnexplained = 0.3;
/// Below that a cause is not worth a word beside others.
constexpr double kWorthSaying = 0.15;
/// Once may be chance.
constexpr std::size_t kFacts = 2;

template <Symptom kSymptom>
double Seen(const Evidence& evidence) {
  return evidence.Share({kSymptom});
}

/// One noise on a line without checksums may look like a request.
double OtherMaster(const Evidence& evidence) {
  if (evidence.Count({other_master, master_beside}) < kFacts) return 0;
  return std::max(0.5, evidence.Share({other_master, other_device, other_reply, damaged, noise}));
}

double OtherDevice(const Evidence& evidence) {
  return evidence.Count(other_device) < kFacts ? 0 : evidence.Share({other_device});
}

/// It may come when it likes, and the device is silent beside it.
double Text(const Evidence& evidence) {
  return evidence.Count(text) == 0 ? 0 : evidence.Share({text, silence, head_lost});
}

/// Where a gap splits replies, a rest that comes alone looks like a lost head or tail.
double InPieces(const Evidence& evidence) {
  return evidence.Count(split) == 0 ? 0
                                    : evidence.Share({split, tail_lost, head_lost, end_lost,
                                                      bytes_lost, bad_check, damaged, odd, noise});
}

double Late(const Evidence& evidence) {
  if (evidence.Count(late) == 0) return 0;
  return evidence.Share({late, silence, other_reply, odd, head_lost});
}

constexpr std::initializer_list<Symptom> kUnreadable = {
    noise,      zeros,       damaged,   head_lost, tail_lost,  end_lost,
    bytes_lost, bytes_added, bad_check, odd,       eighth_bit, endless};

/// Bytes came, and never a frame.
double WrongSettings(const Evidence& evidence) {
  if (evidence.answered || !OnWire(evidence)) return 0;
  if (evidence.Count({noise, damaged, zeros}) == 0) return 0;
  return 0.9 * evidence.Share(kUnreadable);
}

double NoTcp(const Evidence& evidence) {
  if (evidence.answered || OnWire(evidence)) return 0;
  return 0.9 * evidence.Share({noise, zeros, damaged, head_lost, tail_lost, end_lost, bytes_lost,
                               bytes_added, bad_check, odd, endless});
}

double Noise(const Evidence& evidence) {
  if (!evidence.answered) return 0;
  return 0.9 * evidence.Share({noise, zeros, damaged, head_lost, tail_lost, end_lost, bytes_lost,
                               bytes_added, bad_check, eighth_bit});
}

/// All that failed had a byte which converters change, and nothing good had.
double NotTransparent(const Evidence& evidence) {
  if (evidence.device == nullptr || !evidence.answered) return 0;
  if (evidence.failed < kFacts || Suspects(evidence) == 0) return 0;
  return evidence.Share({damaged, noise, bad_check, bytes_lost, bytes_added, tail_lost});
}

/// Where others are read well, that of one is damage.
double EighthBit(const Evidence& evidence) {
  return evidence.answered ? 0 : evidence.Share({eighth_bit});
}

double BadCheck(const Evidence& evidence) {
  return evidence.answered ? 0 : evidence.Share({bad_check});
}

/// Where single ones are lost in noise, others are damaged.
template <Symptom kSymptom>
double Always(const Evidence& evidence) {
  const double share = evidence.Share({kSymptom});
  return evidence.answered && share < 0.6 ? 0 : share;
}

double Silent(const Evidence& evidence) { return 0.9 * evidence.Share({silence}); }

/// All requests for short replies are answered, and none for long ones.
double TooLong(const Evidence& evidence) {
  if (evidence.device == nullptr) return 0;
  const Findings& findings = evidence.device->status.findings;
  const bool split =
      findings.LongestGood() > 0 && findings.ShortestSilent() > findings.LongestGood();
  return split && findings.SilentLong() >= kFacts ? evidence.Share({silence}) : 0;
}

double Odd(const Evidence& evidence) {
  return evidence.Count(odd) == 0 || evidence.Last(odd).cause.empty() ? 0 : evidence.Share({odd});
}

bool IsException(const std::string& reason) {
  return reason.find("exception") != std::string::npos;
}

/// A server has said why there is no value, or has gone.
double Said(const Evidence& evidence) {
  if (evidence.Count(odd) > 0 && IsException(evidence.Last(odd).cause)) {
    return evidence.Share({odd});
  }
  const bool ended = LastReason(evidence).find("connection") != std::string::npos;
  return ended ? 0.95 * evidence.Share({silence}) : 0;
}

template <Symptom kSymptom>
std::string AsFound(const Evidence& evidence) {
  return WithRemedy(evidence.Last(kSymptom));
}

}  // namespace

const std::vector<Hypothesis>& Hypotheses() {
  // Of two that are supported equally the first is said: what is proven stands before what is
  // likely.
  static const std::vector<Hypothesis> kAll = {
      {"other protocol", Seen<other_protocol>, AsFound<other_protocol>},
      {"other setting", Seen<other_setting>, AsFound<other_setting>},
      {"other master", OtherMaster, SayOtherMaster},
      {"other device", OtherDevice, SayOtherDevice},
      {"text", Text, SayText},
      {"echo", Seen<echo>, SayEcho},
      {"late echo", Seen<late_echo>, SayLateEcho},
      {"not transparent", NotTransparent, SaySpecials},
      {"split", InPieces, SaySplit},
      {"late", Late, SayLate},
      {"eighth bit", EighthBit, SayEighthBit},
      {"head lost", Seen<head_lost>, SayHeadLost},
      {"end lost", Always<end_lost>, SayEndLost},
      {"tail lost", Always<tail_lost>, SayTailLost},
      {"bytes lost", Always<bytes_lost>, SayBytesLost},
      {"bytes added", Always<bytes_added>, SayBytesAdded},
      {"bad check", BadCheck, SayBadCheck},
      {"zeros", Seen<zeros>, SayZeros},
      {"endless", Seen<endless>, SayEndless},
      {"one behind", Always<one_behind>, SayOneBehind},
      {"late other", Seen<late_other>, SayLateOther},
      {"other reply", Seen<other_reply>, SayOtherReply},
      {"too long", TooLong, SayTooLong},
      {"said", Said, SaySaid},
      {"no Modbus TCP", NoTcp, SayNoTcp},
      {"settings", WrongSettings, SaySettings},
      {"noise", Noise, SayNoise},
      {"odd", Odd, SayOdd},
      {"silence", Silent, SaySilent},
  };
  return kAll;
}

std::vector<const Hypothesis*> Judge(const Evidence& evidence) {
  std::vector<std::pair<double, const Hypothesis*>> all;
  for (const Hypothesis& hypothesis : Hypotheses()) {
    const double support = hypothesis.support(evidence);
    if (support >= kWorthSaying) all.emplace_back(support, &hypothesis);
  }
  std::ranges::stable_sort(all, std::ranges::greater{},
                           &std::pair<double, const Hypothesis*>::first);
  std::vector<const Hypothesis*> said;
  if (all.empty()) return said;
  said.push_back(all[0].second);
  const bool more =
      all.size() > 1 && all[0].first <= 1 - kUnexplained && all[1].first >= kUnexplained;
  if (more) said.push_back(all[1].second);
  return said;
}

}  // namespace baudgate::control
