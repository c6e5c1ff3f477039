// Bytes on a line as the fuzzer makes them: pieces, of which some end a fragment and some get a
// right checksum, because no fuzzer guesses a CRC.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "protocols/protocol.h"
#include "tests/fuzz/fuzz.h"

namespace baudgate::fuzz {

struct Stream {
  Bytes bytes;
  std::vector<std::size_t> cuts;  ///< ends of fragments, ascending
};

/// Appends the check value that the protocol's frames end with, over what begins at `from`.
/// `checksum`: which kind, where it has several (Expectation::checksum).
void Seal(const protocols::Protocol& protocol, Bytes& bytes, std::size_t from, int checksum = 0);

/// Takes the check value off a whole frame, so that Seal can make it anew.
void Unseal(const protocols::Protocol& protocol, Bytes& frame, int checksum = 0);

/// All pieces that are left in the input: one byte of length (6 bits), 0x40 = seal everything since
/// the last seal, 0x80 = a fragment ends here; then the piece.
Stream TakeStream(const protocols::Protocol& protocol, Input& input);

}  // namespace baudgate::fuzz
