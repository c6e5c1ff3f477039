// The sentence of each cause that gateway/status/hypotheses.cpp knows: cause and remedy, without a
// subject. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/status/evidence.h"

namespace baudgate::control {

/// The line has a bit rate and a parity.
bool OnWire(const Evidence& evidence);
/// The settings of the wire are those of a serial server.
bool IsBehindServer(const Evidence& evidence);
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

}  // namespace baudgate::control
