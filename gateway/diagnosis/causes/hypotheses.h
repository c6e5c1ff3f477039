// What may be wrong with a device or a line, as a table: how well the evidence supports each cause,
// and the sentence that names cause and remedy. The best one is said, and at most one more. Pure.
//
//   evidence                                           the best hypothesis
//   nothing but silence, a neighbour answers           the device, its address or its own wire
//   nothing but silence on the whole line              the line: port, bit rate, A and B
//   bytes, never a frame, from nobody                  bit rate or parity
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
  const char* cause;  ///< as docs/status.md shows it
  /// 0: excluded; 1: it explains all that has failed.
  double (*support)(const Evidence&);
  /// Cause and remedy, without a subject: "answers later than timing.reply (100 ms): …".
  std::string (*say)(const Evidence&);
  bool proven = false;  ///< what was seen leaves no doubt, so that nothing else need be said
  bool whole = false;   ///< it explains why only some requests fail
};

/// All that is known.
const std::vector<Hypothesis>& Hypotheses();

/// The best supported one and, where it leaves much unexplained, the next; empty: there is none. Of
/// several kinds of failures the cause that was said at the last look stays, until another one is
/// clearly stronger.
std::vector<const Hypothesis*> Judge(const Evidence& evidence);

/// What goes with the first one: the alternative, a neighbour that is well or fails alike.
std::vector<std::string> Besides(const Evidence& evidence,
                                 const std::vector<const Hypothesis*>& judged);

/// What both ends must agree on, to be tried: "bit rate, parity, checksum and protocol (9600 8N1,
/// checksum off here, dcon)".
std::string Settings(const bus::DeviceRecord& record);
/// ", checksum off here"; empty: its protocol has one only.
std::string CheckOf(const bus::DeviceRecord& record);

// ---------------- damage_words.cpp: how well the form of damaged replies explains the failures

/// So many exchanges of one kind are no chance.
inline constexpr std::size_t kMany = 8;

/// The share of failures with this symptom; 0 if the device has answered and the share is below
/// 0.6, because noise damages some replies in this way and others differently.
template <Symptom kSymptom>
double Always(const Evidence& evidence) {
  const double share = evidence.Share({kSymptom});
  return evidence.answered && share < 0.6 ? 0 : share;
}

/// Characters are lost anywhere in its lines of text, the first and the last among them, and
/// nothing that noise does was seen.
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

/// The line has a bit rate and a parity.
bool OnWire(const Evidence& evidence);
/// The settings of the wire are those of a serial server.
bool IsBehindServer(const Evidence& evidence);
/// "another program reads the port (mbpoll, pid 4711)".
std::string OtherReader(const Evidence& evidence);
/// Cause of head_lost and end_lost: the byte is there, and is another one.
inline constexpr std::string_view kGarbled = "garbled";
/// Its replies carry no check value, and are right at other times, so that what does not fit is
/// damaged.
bool IsDamageAsMisfit(const Evidence& evidence);
/// Most check values are wrong in the same way. By chance some messages are right in both.
bool IsComputedOtherwise(const Evidence& evidence);
/// The bytes of kSpecialBytes that a converter may change, one bit each.
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
