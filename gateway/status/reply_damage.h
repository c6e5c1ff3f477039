// How well the form of damaged replies explains the failures of a device, from 0 to 1: which part
// is missing, which bytes fail, which lengths. Used by gateway/status/hypotheses.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gateway/status/evidence.h"

namespace baudgate::control {

/// No chance any more.
inline constexpr std::size_t kMany = 8;

/// Where single ones are lost in noise, others are damaged.
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

}  // namespace baudgate::control
