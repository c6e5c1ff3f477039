// Plays golden transcripts, which are captured exchanges as text, against a conversation.
//
//   # comment
//   device: address=1 checksum=true       options as key=value; address is the device's address
//   device: address=1 profile=mt-sics     the points and options of a shipped profile
//   device: address=1 events              the device's events are read
//   point: current_l1 I1 float32 fast     name, read, type, and optionally: group (default fast),
//                                         rw, w (never read), write=ADDRESS, scale=NUMBER,
//                                         unit=TEXT
//   point: energy "05 00 00 energy@0" float64     a word that contains blanks is quoted
//   > 3E 31 52 ...                        the request that the conversation must make; a '>' alone
//                                         is a broadcast (expect.reply: none)
//   < 0A 3C 31 ...                        the reply; several lines are one stream. A time before a
//   +12ms                                 line is a silence longer than any gap. Without a reply,
//                                         the device is silent
//   = current_l1 0.52 good                all readings of the reply, in this order:
//   = current_l2 bad: sensor failure      name, value (if any), quality as printed for people
//   ! corrupt                             the outcome, if it is not ok
//   write: relay true                     writes the point now; the value is written as users do
//   > ... < ... = ... ! ...               exchanges of the write, including password and read-back;
//                                         the outcome of the last one is that of the write
//   write: relay 7                        a write without an exchange: nothing may be sent, and the
//   ! unsupported                         write ends with this outcome
//   events:                               reads the events now; the exchanges follow, including
//                                         requests that repeat a lost one
//   = event 0 1 12.345s                   an event: channel, code, time and further text. It is
//                                         stored at once
//   = again                               before events: the batch may repeat the last one
//   = drained                             the device has no more events
//   unasked:                              the device sends the following bytes unasked, a second
//   < 0D 0A 2D ...                        after the bytes before. A time before a piece is the
//   exact
//                                         delay of the piece. The values are those of all messages,
//                                         and of everything that becomes due meanwhile
//
// Without `write:` or `events:`, the queries are run in the order of Queries(), round after round
// until the file ends, following ask_again and replan.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "protocols/protocol.h"

namespace baudgate {

void PlayTranscript(const protocols::Protocol& protocol, const std::string& path);

}  // namespace baudgate
