// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/causes/hypotheses.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <utility>

#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using enum Symptom;

/// If a hypothesis leaves this share of the failures unexplained, a second hypothesis is shown.
constexpr double kUnexplained = 0.3;
/// A hypothesis that explains this share of the failures is shown at once. Otherwise the hypothesis
/// that was shown last remains until another explains kStronger times as many failures.
constexpr double kNearlyAll = 0.85;
constexpr double kStronger = 1.5;
/// Hypotheses that explain a smaller share are ignored.
constexpr double kWorthSaying = 0.15;
constexpr std::string_view kSetProtocol = "set protocol: ";
/// A pattern of fewer silent exchanges may be chance.
constexpr std::size_t kSilences = 3;
/// No device needs a longer pause than this before a request.
constexpr Duration kLongestPause = 300ms;
/// No device falls asleep sooner than this.
constexpr Duration kShortestSleep = 200ms;

template <Symptom kSymptom>
double Seen(const Evidence& evidence) {
  return evidence.Share({kSymptom});
}

/// Cause: another master is on the line. A single finding is not enough: without checksums noise
/// can look like a request. If exchanges of a neighbour prove the master, late echoes at this
/// device are requests of this master.
double OtherMaster(const Evidence& evidence) {
  const bool own = evidence.Count({other_master, master_beside}) >= kFacts;
  const bool elsewhere = evidence.master != nullptr && evidence.Count(late_echo) > 0;
  if (!own && !elsewhere) return 0;
  const double share =
      evidence.Share({other_master, other_device, other_reply, damaged, noise, late_echo});
  return own ? std::max(0.5, share) : share;
}

/// Cause: a converter removes XON or XOFF from requests, so requests that contain them fail.
double EatenRequests(const Evidence& evidence) {
  if (evidence.eaten == 0 || evidence.device == nullptr) return 0;
  return HasDeadQuery(*evidence.device, kNeverAnswered) ? 1 : 0;
}

/// True if retries fail too. Then replies are not one request late: a retry would get the right
/// reply.
bool RepeatsFail(const Evidence& evidence) {
  return evidence.device != nullptr && evidence.device->status.findings.LongestRun() > kFacts;
}

/// Cause: another device answers. If retries fail as well, a reply that seems to answer the
/// previous request comes from a neighbour.
double OtherDevice(const Evidence& evidence) {
  const bool neighbour = !evidence.healthy.empty() && RepeatsFail(evidence) &&
                         !evidence.Last(one_behind).remedy.empty();
  const std::size_t count =
      evidence.Count(other_device) + (neighbour ? evidence.Count(one_behind) : 0);
  if (count < kFacts) return 0;
  // Damage can turn one address into another, so the finding must be nearly constant.
  if (IsDamageAsMisfit(evidence) && 10 * count < 9 * evidence.seen) return 0;
  return evidence.Share({other_device}) + (neighbour ? evidence.Share({one_behind}) : 0);
}

/// True if the device sends unasked and some of its messages are right, so that the others are
/// damaged.
bool IsDamageOnly(const Evidence& evidence) {
  const bus::DeviceRecord& record = evidence.first();
  if (!evidence.answered || !record.status.unasked) return false;
  if (2 * evidence.failed < evidence.looked) return true;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    if (record.age_limits[static_cast<std::size_t>(record.device->points[i].group)].ages() &&
        IsGood(QualityAt(record, i, evidence.now))) {
      return true;
    }
  }
  return false;
}

/// Cause: a setting of the device differs. If a third of the failures show this, the cause explains
/// all damage.
double OtherSetting(const Evidence& evidence) {
  if (IsDamageOnly(evidence) || LosesAnywhere(evidence)) return 0;
  const std::size_t count = evidence.Count(other_setting);
  // A device that has never answered is also probed with other requests, and perhaps does not
  // answer these.
  if (!evidence.answered && count >= kFacts) return evidence.Share({other_setting, silence});
  if (count < kSilences || 3 * count < evidence.seen) return evidence.Share({other_setting});
  return evidence.Share(
      {other_setting, damaged, noise, bad_check, bytes_lost, tail_lost, end_lost, head_lost});
}

/// Cause: the device restarts: it is silent, sends a text, and answers again.
double Restarts(const Evidence& evidence) {
  constexpr std::ptrdiff_t kWord = 4;  // fewer letters are the rest of a reply
  const Finding& words = evidence.Words();
  if (evidence.device == nullptr || evidence.absent || !words.remedy.empty()) return 0;
  const auto letters = std::ranges::count_if(
      words.cause, [](unsigned char character) { return std::isalpha(character) != 0; });
  const bool starts = evidence.device->status.findings.Starts() > 0 && letters >= kWord;
  return starts ? evidence.Share({text, silence}) : 0;
}

/// Cause: something sends text, and requests meanwhile get no answer. If no reply was ever good and
/// many bytes are unreadable, a text may be chance, so the result is halved.
double Text(const Evidence& evidence) {
  if (evidence.Count(text) < (evidence.answered ? kFacts : 1)) return 0;
  const bool chance = !evidence.answered && evidence.Share({noise, damaged}) >= kUnexplained;
  return (chance ? 0.5 : 1) * evidence.Share({text, silence, head_lost});
}

/// Cause: replies come in pieces. A piece that comes alone looks like a reply without its beginning
/// or end, so these symptoms are included.
double InPieces(const Evidence& evidence) {
  // If a message that is sent unasked comes in pieces, each piece counts as a bad message.
  if (evidence.first().status.unasked && evidence.Count(split) >= kFacts) {
    return evidence.Share({split, other_setting, damaged, noise, odd, other_form, tail_lost});
  }
  // A single reply may look split because of a burst of noise.
  return evidence.Count(split) < (evidence.answered ? kFacts : 1)
             ? 0
             : evidence.Share({split}, {tail_lost, head_lost, end_lost, bytes_lost, bad_check,
                                        damaged, odd, noise, other_form});
}

double Late(const Evidence& evidence) {
  if (evidence.Count(late) == 0) return 0;
  // If another cause is known for most other_reply findings, they are not late replies.
  const bool told = !evidence.Last(other_reply).cause.empty() &&
                    evidence.Count(other_reply) > 2 * evidence.Count(late);
  return told ? evidence.Share({late}, {silence, odd, head_lost})
              : evidence.Share({late}, {silence, odd, head_lost, other_reply});
}

constexpr std::initializer_list<Symptom> kUnreadable = {
    noise,       zeros,     damaged, head_lost,  tail_lost, end_lost,  bytes_lost,
    bytes_added, bad_check, odd,     eighth_bit, endless,   other_form};

/// Cause: wrong serial settings. Bytes came but never a good frame, or none for longer than noise
/// lasts.
double WrongSettings(const Evidence& evidence) {
  if ((evidence.answered && !evidence.changed) || !OnWire(evidence)) return 0;
  if (evidence.Count({noise, damaged, zeros}) == 0) return 0;
  return 0.9 * (evidence.Share(kUnreadable) + evidence.Share({text}));
}

double Zeros(const Evidence& evidence) { return OnWire(evidence) ? evidence.Share({zeros}) : 0; }

/// Cause: something sends without end. The bytes may pause, so that each exchange contains only
/// some of them; then all bytes since the last answer are counted.
double Endless(const Evidence& evidence) {
  constexpr double kPart = 0.05;     // share of what the line can carry
  constexpr double kCharacter = 10;  // in bits
  constexpr std::uint64_t kLot = 2048;
  const bus::LineStatus& status = *evidence.status;
  const double seen = evidence.Share({endless});
  if (!evidence.absent || !OnWire(evidence) || status.babble < kLot) return seen;
  const double most =
      SerialOf(evidence.first()).baud / kCharacter * Seconds(evidence.now - status.babble_since);
  return static_cast<double>(status.babble) >= kPart * most ? 1 : seen;
}

double NoTcp(const Evidence& evidence) {
  if (evidence.answered || OnWire(evidence)) return 0;
  return 0.9 * evidence.Share({noise, zeros, damaged, head_lost, tail_lost, end_lost, bytes_lost,
                               bytes_added, bad_check, odd, endless});
}

double Noise(const Evidence& evidence) {
  if (!evidence.answered) return 0;
  const bool damage = IsDamageOnly(evidence) && !evidence.changed;
  const double others = damage ? evidence.Share({other_setting}) : 0;
  return 0.9 *
         (others + evidence.Share({noise, zeros, damaged, head_lost, tail_lost, end_lost,
                                   bytes_lost, bytes_added, bad_check, eighth_bit, other_form}));
}

double OtherForm(const Evidence& evidence) {
  return IsDamageOnly(evidence) ? 0 : Always<other_form>(evidence);
}

double OneBehind(const Evidence& evidence) {
  if (evidence.Count(one_behind) >= kFacts && evidence.Last(one_behind).cause == "lags") {
    return evidence.Share({one_behind, late, late_other, silence, other_reply});
  }
  if (!evidence.answered || evidence.device == nullptr) return 0;
  return RepeatsFail(evidence) ? 0 : Always<one_behind>(evidence);
}

double SameAgain(const Evidence& evidence) {
  if (evidence.Count(same_again) < kFacts) return 0;
  return evidence.Share({same_again, one_behind, other_reply, odd, late});
}

/// Cause: another service or protocol answers. It may send a greeting once and be silent
/// afterwards.
double OtherProtocol(const Evidence& evidence) {
  if (evidence.answered || evidence.Count(other_protocol) < kFacts) {
    return evidence.Share({other_protocol});
  }
  return evidence.Share({other_protocol, silence, tail_lost, noise, damaged});
}

double Silent(const Evidence& evidence) { return 0.9 * evidence.Share({silence}); }

/// Cause: requests come too soon after other traffic: only these get no answer. If nearly all
/// requests come so soon, because a neighbour keeps the line busy, more failures are required.
double TooFast(const Evidence& evidence) {
  if (evidence.device == nullptr || !evidence.answered) return 0;
  const bool few = evidence.looked - evidence.failed < kSilences;
  if (evidence.Count(silence) < (few ? kMany : kSilences)) return 0;
  const Duration pause = evidence.device->status.findings.ShortPause();
  if (pause == Duration() || (few && pause > kLongestPause)) return 0;
  return evidence.Share({silence});
}

/// Cause: the device falls asleep: only requests after a silence of the line get no answer.
double Asleep(const Evidence& evidence) {
  // The line is also silent while neighbours do not answer, so a silence before the request proves
  // nothing then.
  if (evidence.device == nullptr || evidence.absent || !evidence.away.empty()) return 0;
  if (!evidence.losing.empty()) return 0;
  if (evidence.looked - evidence.failed < kMany || evidence.Count(silence) < kSilences) return 0;
  const bus::Findings& findings = evidence.device->status.findings;
  // A request would wake the device, so a retry is answered.
  if (findings.LongestRun() > kFacts) return 0;
  return findings.LongRest() >= kShortestSleep ? evidence.Share({silence}) : 0;
}

double Odd(const Evidence& evidence) {
  const bool proven = evidence.Count(odd) > 0;
  if (evidence.Last(proven ? odd : one_behind).cause.empty()) return 0;
  if (proven && IsDamageAsMisfit(evidence)) {
    return evidence.Share({odd, one_behind, other_device, damaged, bytes_lost});
  }
  return (proven ? 1 : 0.5) * evidence.Share({odd, one_behind});
}

/// Cause: the device or a gateway in front of it has given a reason in place of a value, or the
/// server has closed the connection.
double InItsPlace(const Evidence& evidence) {
  if (evidence.Count(odd) > 0 && !evidence.Last(odd).remedy.empty()) {
    return IsDamageAsMisfit(evidence) ? 0 : evidence.Share({odd});
  }
  return evidence.Last(silence).ended ? 0.95 * evidence.Share({silence}) : 0;
}

/// Cause: two devices answer and damage each other's replies. At an address to which every device
/// answers (HasCommonAddress), one second reply is proof enough.
double TwoReplies(const Evidence& evidence) {
  const bus::DeviceRecord& record = evidence.first();
  const bool common = HasCommonAddress(*record.device) &&
                      (record.status.doubled > 0 || evidence.Count(others_beside) > 0);
  if (evidence.Count(two_replies) == 0 && !common) return 0;
  const double share = evidence.Share({two_replies, damaged, noise, bad_check, bytes_added});
  return common ? share + evidence.Share({tail_lost, end_lost, head_lost, bytes_lost, odd}) : share;
}

template <Symptom kSymptom>
std::string AsFound(const Evidence& evidence) {
  return WithRemedy(evidence.Last(kSymptom));
}

/// If a neighbour is read well with the configured protocol, the remedy is to change the protocol
/// of the device itself.
std::string SayOtherProtocol(const Evidence& evidence) {
  Finding finding = evidence.Last(other_protocol);
  if (!evidence.healthy.empty() && finding.remedy.starts_with(kSetProtocol)) {
    finding.remedy = "set the device to " + evidence.device->device->protocol + ", as " +
                     evidence.healthy + " is";
  }
  return WithRemedy(finding);
}

}  // namespace

const std::vector<Hypothesis>& Hypotheses() {
  // If two hypotheses explain the same share, the first in the table is shown, so causes that are
  // certain come before probable causes.
  static const std::vector<Hypothesis> kAll = {
      {"another protocol or service answers", OtherProtocol, SayOtherProtocol, true},
      {"another setting would make its replies right", OtherSetting, AsFound<other_setting>, true},
      {"another master sends on the line", OtherMaster, SayOtherMaster, true},
      {"slave N answers where slave N was asked", OtherDevice, SayOtherDevice, true},
      {"its reply to TELEGRAM is not as described", OtherForm, AsFound<other_form>},
      {"it restarts", Restarts, SayRestarts},
      {"text comes in place of replies", Text, SayText},
      {"only the request itself comes back", Seen<echo>, SayEcho, true},
      {"the gateway's own requests come back late", Seen<late_echo>, SayLateEcho},
      {"only requests that contain", EatenRequests, SayEatenRequests, true, true},
      {"only replies that contain", NotTransparent, SaySpecials},
      {"its replies come in pieces", InPieces, SaySplit, true},
      {"its replies come up to", Late, SayLate, true},
      {"two different replies come to one request", TwoReplies, SayTwoReplies, true},
      {"its characters are right without the eighth bit", EighthBit, SayEighthBit},
      {"the eighth bit of its replies is always 0", SevenBits, SaySevenBits},
      {"long replies come damaged", LongDamaged, SayLongDamaged, false, true},
      {"only characters with the right parity arrive", OtherParity, SayOtherParity},
      {"the first byte of its replies is missing", HeadLost, SayHeadLost},
      {"its replies break off", BreaksOff, SayTailLost},
      {"the last byte of its replies is missing", EndLost, SayEndLost},
      {"bytes are missing inside its replies", BytesLost, SayBytesLost},
      {"its replies have too many bytes", Always<bytes_added>, SayBytesAdded},
      {"its replies have a wrong check value", BadCheck, SayBadCheck},
      {"nothing but 00 or FF comes", Zeros, SayZeros},
      {"bytes come without an end", Endless, SayEndless},
      {"it answers every request with the same reply", SameAgain, SaySameAgain, true},
      {"its replies answer the previous request", OneBehind, SayOneBehind},
      {"late replies of", Seen<late_other>, SayLateOther},
      {"replies come that belong to other requests", Seen<other_reply>, SayOtherReply},
      {"it does not answer requests for long replies", TooLong, SayTooLong},
      {"requests soon after a message get no answer", TooFast, SayTooFast},
      {"requests after a pause get no answer", Asleep, SayAsleep},
      {"a gateway or server speaks in its place", InItsPlace, SaySaid},
      {"its replies are not Modbus TCP", NoTcp, SayNoTcp},
      {"bytes come, but no good frame", WrongSettings, SaySettings},
      {"its replies come damaged", Noise, SayNoise},
      {"its replies do not fit the requests", Odd, SayOdd},
      {"not a byte came", Silent, SaySilent},
  };
  return kAll;
}

std::vector<const Hypothesis*> Judge(const Evidence& evidence) {
  using Supported = std::pair<double, const Hypothesis*>;
  std::vector<Supported> all;
  for (const Hypothesis& hypothesis : Hypotheses()) {
    const double support = hypothesis.support(evidence);
    if (support >= kWorthSaying) all.emplace_back(support, &hypothesis);
  }
  std::ranges::stable_sort(all, std::ranges::greater{}, &Supported::first);
  std::vector<const Hypothesis*> said;
  if (all.empty()) return said;
  if (evidence.device != nullptr) {
    std::atomic<std::size_t>& last = evidence.device->status.findings.said();
    const Hypothesis* const before = last > 0 ? &Hypotheses()[last - 1] : nullptr;
    const auto kept = std::ranges::find(all, before, &Supported::second);
    const bool mixed = all[0].first < kNearlyAll && !all[0].second->proven;
    if (mixed && kept != all.end() && kStronger * kept->first > all[0].first) {
      std::rotate(all.begin(), kept, kept + 1);
    }
    last = static_cast<std::size_t>(all[0].second - Hypotheses().data()) + 1;
  }
  said.push_back(all[0].second);
  const bool more = all.size() > 1 && !all[0].second->proven && all[0].first <= 1 - kUnexplained &&
                    all[1].first >= kUnexplained;
  if (more) said.push_back(all[1].second);
  return said;
}

std::vector<std::string> Besides(const Evidence& evidence,
                                 const std::vector<const Hypothesis*>& judged) {
  std::vector<std::string> besides;
  for (const Hypothesis* hypothesis : judged) {
    if (hypothesis != judged.front()) besides.push_back("or " + hypothesis->say(evidence));
  }
  if (evidence.absent && judged.front()->support == TooFast) {
    besides.push_back("or it is off. Check its power and its wire");
  }
  const std::string counterpart(evidence.traits().counterpart);
  const bool never = !evidence.answered && evidence.healthy.empty() && !OnWire(evidence);
  if (never && !counterpart.empty() && judged.front()->support == Silent) {
    besides.push_back("or the port belongs to a plain serial server. Set protocol: " + counterpart);
  }
  if (!evidence.alike.empty() && evidence.fell.empty()) {
    besides.push_back(evidence.alike +
                      " fails in the same way. Check first what these two devices share");
  }
  if (evidence.absent && !evidence.healthy.empty()) {
    besides.push_back(evidence.healthy + " answers on the same line");
  }
  return besides;
}

}  // namespace baudgate::diagnosis
