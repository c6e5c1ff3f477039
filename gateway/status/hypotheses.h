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

#include <string>
#include <vector>

#include "gateway/status/evidence.h"

namespace baudgate::control {

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

/// The best supported one and, where it leaves much unexplained, the next; empty: there is none.
std::vector<const Hypothesis*> Judge(const Evidence& evidence);

/// What goes with the first one: the alternative, a neighbour that is well or fails alike.
std::vector<std::string> Besides(const Evidence& evidence,
                                 const std::vector<const Hypothesis*>& judged);

/// What both ends must agree on: "address 2, 9600 7E1, checksum crc".
std::string Settings(const DeviceRecord& record);
/// ", checksum crc"; empty: its protocol has one only.
std::string CheckOf(const DeviceRecord& record);

}  // namespace baudgate::control
