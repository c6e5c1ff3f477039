// Golden transcripts: captured exchanges as text, played against a conversation.
//
//   # comment
//   device: address=1 checksum=true       options as key=value; address is the device's
//   device: address=1 profile=mt-sics     the points and options of a shipped profile
//   point: current_l1 I1 float32 fast     name, read, type, and where wanted: group (default fast),
//                                         rw, w (never read), write=ADDRESS,
//                                         scale=NUMBER, unit=TEXT
//   point: energy "05 00 00 energy@0" float64         what holds blanks stands in double quotes
//   > 3E 31 52 ...                        the request that the conversation must make
//   < 0A 3C 31 ...                        the reply that it gets; several lines are one stream,
//   +12ms                                 with a silence longer than any gap where a time stands
//   A broadcast (expect.reply: none) is a '>' alone.
//   = current_l1 0.52 good                what must have been read, all of it and in this order:
//   = current_l2 bad: sensor failure      name, value (where there is one), quality as people read
//                                         it
//   ! corrupt                             the outcome, where it is not ok
//   write: relay true                     the point is written now, with the value as users give
//   it: > ... < ... = ... ! ...               its exchanges follow, a password and a read-back
//   among
//                                         them; the last one's outcome is that of the write
//   device: address=1 events              its events are wanted
//   events:                               they are asked for now; its exchanges follow, and what
//                                         is sent in place of a lost one
//   = event 0 1 12.345s                   an event: channel, code, time, and what it says beyond.
//                                         It is kept at once
//   = again                               before them: the batch may be the last one once more
//   = drained                             there are no more in the device
//   unasked:                              the device says what follows by itself, a second after
//   what < 0D 0A 2D ...                        came before; a time before a piece is kept. Its
//   values are
//                                         those of all messages and of what becomes due meanwhile
//   write: relay 7                        without an exchange: nothing may be sent, and the write
//   ! unsupported                         ends so
//
// Where nothing is written, every query is asked in turn, in the order of Queries() and round after
// round until the file ends, following ask_again and replan. Nothing after '>' is silence.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "protocols/protocol.h"

namespace baudgate {

/// Plays the file; every difference is a GoogleTest failure that names file and line.
void PlayTranscript(const protocols::Protocol& protocol, const std::string& path);

}  // namespace baudgate
