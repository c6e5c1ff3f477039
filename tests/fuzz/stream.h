// Makes a byte stream from the fuzzer's input. Bits of the input say where a fragment ends, and
// where a right checksum is added, because a fuzzer cannot guess a CRC.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "protocols/protocol.h"
#include "tests/fuzz/fuzz.h"

namespace baudgate::fuzz {

struct Stream {
  Bytes bytes;
  std::vector<std::size_t> cuts;
};

/// Appends the check value of the protocol's frames over the bytes from index `from` on. `checksum`
/// is the kind of check value, if the protocol has several (Expectation::checksum).
void Seal(const protocols::Protocol& protocol, Bytes& bytes, std::size_t from, int checksum = 0);

void Unseal(const protocols::Protocol& protocol, Bytes& frame, int checksum = 0);

/// Takes all remaining pieces of the input. The byte before a piece contains its length in the low
/// 6 bits. 0x40: a check value over everything since the last check value is appended; 0x80: a
/// fragment ends behind the piece.
Stream TakeStream(const protocols::Protocol& protocol, Input& input);

}  // namespace baudgate::fuzz
