// Golden transcripts: captured exchanges as text, played against a conversation.
//
//   # comment
//   device: address=1 checksum=true       options as key=value; address is the device's
//   point: current_l1 I1 float32 fast     name, read, type, group (the rest at its default)
//   > 3E 31 52 ...                        the request that the conversation must make
//   < 0A 3C 31 ...                        the reply that it gets; several lines are one stream,
//   +12ms                                 with silence between them where a time stands
//   = current_l1 0.52 good                what must have been read: name, value, quality
//   ! corrupt                             the outcome, where it is not ok
//
// The suite asks every query in turn, in the order of Queries(), following ask_again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "protocols/protocol.h"

namespace baudgate {

/// Plays the file; every difference is a GoogleTest failure that names file and line.
void PlayTranscript(const Protocol& protocol, const std::string& path);

}  // namespace baudgate
