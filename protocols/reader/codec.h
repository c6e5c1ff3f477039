// The wire format of readers. They speak by themselves; two commands may be sent to some.
//   form: tag    CR LF - 06001259E3 CR LF >   ten hex digits, of an EM4100 tag; zeros: no tag.
//                                             The last prompt may stand in front, or be missing
//   form: text   STX ST,GS,+  12.35kg ETX     start and end are options (settings.h)
//   r CR                                      read now: answered as a tag is told
//   i CR                                      what are you? MOD-RFID125-BOX CR LF >, or more lines
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

inline constexpr std::size_t kTagFrame = 16;  ///< with the prompt
inline constexpr std::size_t kTagDigits = 10;
inline constexpr std::size_t kTagAt = 3;  ///< of the first digit

/// Those that are ever sent. `b` makes a reader wait for new firmware, `m…` changes its settings.
enum class Command : std::uint8_t { read, information };
Bytes EncodeCommand(Command command);
/// Whoever sent it: a captured line may have a reader on it that the configuration never asks.
bool IsInformation(View request);
/// The lines of the answer to `information`, a blank between them, without prompt and echo. An
/// error: there are none, or it is no such answer.
Result<std::string> DecodeInformation(View answer);

Bytes EncodeTag(std::string_view digits);
Bytes EncodeText(std::string_view text, const Settings& settings);

/// Without its ends; where it has no start, also without the CR, LF, 00 and FF around it.
View TextIn(View frame, const Settings& settings);
/// So many of all these may stand around a text.
inline constexpr std::size_t kMostAround = 8;

/// What a whole message says: the digits in upper case, or the text without its ends and the blanks
/// at both sides. An error: characters that are no ASCII, as where the parity differs.
Result<std::string> Decode(View frame, const Settings& settings);

/// A reader has no address: any number tells its users which one it is.
Result<int> ParseAddress(std::string_view text);

}  // namespace baudgate::protocols::reader
