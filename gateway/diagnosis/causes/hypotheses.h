// Hypotheses() is the table of possible causes of trouble with a device or a line. Each entry
// returns how well the evidence supports it, and a sentence with cause and remedy. The best
// hypothesis is shown, and at most one more. No function does I/O or reads a clock. Examples:
//
//   evidence                                           the best hypothesis
//   nothing but silence, a neighbour answers           the device, its address or its own wire
//   nothing but silence on the whole line              the line: port, bit rate, A and B
//   bytes, but no frame from any device                bit rate or parity
//   bytes, but no frame; a neighbour answers           its own settings, or two with one address
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
  const char* cause;  ///< the name of the cause, as in docs/status.md
  /// Returns the share of the failures that the cause explains: 0: the cause is excluded; 1: all
  /// failures.
  double (*support)(const Evidence&);
  /// Returns cause and remedy without the subject, such as "answers later than timing.reply (100
  /// ms): …".
  std::string (*say)(const Evidence&);
  bool proven = false;  ///< the cause is certain if it has support, so no second cause is shown
  bool whole = false;   ///< the cause also explains why only some requests fail
};

const std::vector<Hypothesis>& Hypotheses();

/// Returns the best hypothesis and, if it leaves many failures unexplained, the second best. Empty:
/// none has support. If failures are of several kinds, the cause of the last call remains the first
/// until another is clearly better, so that the status does not change with each call.
std::vector<const Hypothesis*> Judge(const Evidence& evidence);

/// Returns further sentences: the second hypothesis, what else to check, and a neighbour that
/// answers or fails in the same way.
std::vector<std::string> Besides(const Evidence& evidence,
                                 const std::vector<const Hypothesis*>& judged);

/// Returns the settings to check at the device and in the configuration, such as "bit rate, parity,
/// checksum and protocol (9600 8N1, checksum: off, dcon)".
std::string Settings(const bus::DeviceRecord& record);
/// Returns text such as ", checksum: off". Empty: the protocol has no option for a checksum.
std::string CheckOf(const bus::DeviceRecord& record);

// ---------------- damage_words.cpp: the share of the failures that a kind of damage explains

/// This many exchanges of one kind are not chance.
inline constexpr std::size_t kMany = 8;

/// Returns the share of failures with this symptom. Returns 0 if the device has answered and the
/// share is below 0.6, because noise damages replies in many ways, this symptom among them.
template <Symptom kSymptom>
double Always(const Evidence& evidence) {
  const double share = evidence.Share({kSymptom});
  return evidence.answered && share < 0.6 ? 0 : share;
}

/// True if text replies lose characters in different positions and show no symptom of noise.
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

/// True if a serial wire with bit rate and parity carries the requests (false for Modbus TCP).
bool OnWire(const Evidence& evidence);
/// True if the settings of the serial wire are made at a serial server.
bool IsBehindServer(const Evidence& evidence);
/// Returns text such as "another program reads the port (mbpoll, pid 4711)".
std::string OtherReader(const Evidence& evidence);
/// Value of Finding::cause at head_lost and end_lost: the byte has come, but with another value.
inline constexpr std::string_view kGarbled = "garbled";
/// True if replies have no check value and are right at other times. A reply that does not fit is
/// then damaged, and its content proves nothing.
bool IsDamageAsMisfit(const Evidence& evidence);
/// True if most wrong check values would be right if they were computed in another way that
/// Findings::Check has found.
bool IsComputedOtherwise(const Evidence& evidence);
/// Returns the bytes of kSpecialBytes that a converter seems to change, one bit each.
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
