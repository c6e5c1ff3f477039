// Hypotheses() is the table of possible causes of trouble with a device or a line. Each entry
// returns how well the evidence supports it, and the sentence with cause and remedy. The best
// hypothesis is shown, and at most one more. All functions are pure.
//
//   evidence                                           the best hypothesis
//   nothing but silence, a neighbour answers           the device, its address or its own wire
//   nothing but silence on the whole line              the line: port, bit rate, A and B
//   bytes, never a frame, from no device               bit rate or parity
//   bytes, never a frame, and a neighbour answers      its own settings, or two with one address
//   whole replies with pauses                          timing.gap
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/diagnosis/causes/evidence.h"

namespace baudgate::diagnosis {

struct Hypothesis {
  const char* cause;  ///< as in docs/status.md
  /// 0: excluded; 1: explains all failures.
  double (*support)(const Evidence&);
  /// Returns cause and remedy without a subject: "its replies break off. Check …".
  std::string (*say)(const Evidence&);
  bool proven = false;  ///< the evidence leaves no doubt, so no alternative is shown
  bool whole = false;   ///< also explains why only some requests fail
};

const std::vector<Hypothesis>& Hypotheses();

/// Returns the best hypothesis and, if it leaves many failures unexplained, the second best; empty:
/// none is supported. If failures have several kinds, the cause of the last call stays first until
/// another one is clearly stronger, so that the status does not change with each call.
std::vector<const Hypothesis*> Judge(const Evidence& evidence);

/// Additional sentences: the second hypothesis, a neighbour that is well or fails in the same way.
std::vector<std::string> Besides(const Evidence& evidence,
                                 const std::vector<const Hypothesis*>& judged);

/// Names the settings to check at the device and here: "bit rate, parity, checksum and protocol
/// (9600 8N1, checksum off here, dcon)".
std::string Settings(const bus::DeviceRecord& record);
/// ", checksum off here". Empty: the protocol has no checksum option.
std::string CheckOf(const bus::DeviceRecord& record);

// ---------------- damage_words.cpp: how well the form of damaged replies explains the failures

/// This many exchanges of one kind are not chance.
inline constexpr std::size_t kMany = 8;

/// The share of failures with this symptom; 0 if the device has answered and the share is below
/// 0.6, because noise damages some replies in this way and others differently.
template <Symptom kSymptom>
double Always(const Evidence& evidence) {
  const double share = evidence.Share({kSymptom});
  return evidence.answered && share < 0.6 ? 0 : share;
}

/// True if text replies lose characters anywhere, also at both ends, without symptoms of noise.
bool LosesAnywhere(const Evidence& evidence);

double NotTransparent(const Evidence& evidence);
double EighthBit(const Evidence& evidence);
double BadCheck(const Evidence& evidence);
double HeadLost(const Evidence& evidence);
double BytesLost(const Evidence& evidence);
double EndLost(const Evidence& evidence);
double BreaksOff(const Evidence& evidence);
double OtherParity(const Evidence& evidence);
double SevenBits(const Evidence& evidence);
double TooLong(const Evidence& evidence);
double LongDamaged(const Evidence& evidence);

// ---------------- the sentence of each cause: hypothesis_words.cpp, damage_words.cpp

/// True if a serial wire with a bit rate and a parity carries the requests.
bool OnWire(const Evidence& evidence);
/// True if the settings of the wire are made at a serial server.
bool IsBehindServer(const Evidence& evidence);
/// "another program reads the port (mbpoll, pid 4711)".
std::string OtherReader(const Evidence& evidence);
/// Finding::cause of head_lost and end_lost: the byte came, but with another value.
inline constexpr std::string_view kGarbled = "garbled";
/// True if replies without check value are right at other times, so a reply that does not fit is
/// damaged.
bool IsDamageAsMisfit(const Evidence& evidence);
/// True if most wrong check values fit another way of computing them; some are right in both ways.
bool IsComputedOtherwise(const Evidence& evidence);
/// The bytes of kSpecialBytes that a converter seems to change, one bit each.
unsigned Suspects(const Evidence& evidence);

std::string SayOtherDevice(const Evidence& evidence);
std::string SayOtherMaster(const Evidence& evidence);
std::string SayLate(const Evidence& evidence);
std::string SaySplit(const Evidence& evidence);
std::string SayHeadLost(const Evidence& evidence);
std::string SayEndLost(const Evidence& evidence);
std::string SayTailLost(const Evidence& evidence);
std::string SayBytesLost(const Evidence& evidence);
std::string SayBytesAdded(const Evidence& evidence);
std::string SaySpecials(const Evidence& evidence);
std::string SayEatenRequests(const Evidence& evidence);
std::string SayBadCheck(const Evidence& evidence);
std::string SayTooLong(const Evidence& evidence);
std::string SayLongDamaged(const Evidence& evidence);
std::string SayTooFast(const Evidence& evidence);
std::string SayAsleep(const Evidence& evidence);
std::string SaySameAgain(const Evidence& evidence);
std::string SayEighthBit(const Evidence& evidence);
std::string SaySevenBits(const Evidence& evidence);
std::string SayOtherParity(const Evidence& evidence);
std::string SayText(const Evidence& evidence);
std::string SayRestarts(const Evidence& evidence);
std::string SayEcho(const Evidence& evidence);
std::string SayLateEcho(const Evidence& evidence);
std::string SaySettings(const Evidence& evidence);
std::string SayNoTcp(const Evidence& evidence);
std::string SayNoise(const Evidence& evidence);
std::string SayZeros(const Evidence& evidence);
std::string SayEndless(const Evidence& evidence);
std::string SaySilent(const Evidence& evidence);
std::string SaySaid(const Evidence& evidence);
std::string SayOdd(const Evidence& evidence);
std::string SayOneBehind(const Evidence& evidence);
std::string SayLateOther(const Evidence& evidence);
std::string SayTwoReplies(const Evidence& evidence);
std::string SayOtherReply(const Evidence& evidence);

}  // namespace baudgate::diagnosis
