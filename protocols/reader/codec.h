// The wire format of readers. Readers send unasked; some accept two commands.
//   form: tag    CR LF - 06001259E3 CR LF >   ten hex digits, of an EM4100 tag; zeros: no tag.
//                                             The '>' can come before CR LF instead, or be missing
//   form: text   STX ST,GS,+  12.35kg ETX     start and end are options (settings.h)
//   r CR                                      read now: the reply has the form of a tag message
//   i CR                                      identify: MOD-RFID125-BOX CR LF >, or more lines
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

inline constexpr std::size_t kTagFrame = 16;
inline constexpr std::size_t kTagDigits = 10;
inline constexpr std::size_t kTagAt = 3;  ///< offset of the first digit in a tag frame

/// The commands that the gateway sends to readers. It sends no others: `b` makes a reader wait for
/// new firmware, `m…` changes its settings.
enum class Command : std::uint8_t { read, information };
Bytes EncodeCommand(Command command);
/// True if `request` is the information command, whether or not the gateway is configured to send
/// commands.
bool IsInformation(View request);
/// Returns the text of the reply to `information`: its lines, joined by blanks, without '>' and
/// echo. Error: `answer` contains no line, or is not such a reply.
Result<std::string> DecodeInformation(View answer);

Bytes EncodeTag(std::string_view digits);
Bytes EncodeText(std::string_view text, const Settings& settings);

/// Returns the text of a message without its start and end characters. If no start character is
/// configured, CR, LF, 00 and FF around the text are removed as well.
View TextIn(View frame, const Settings& settings);
/// The maximum number of CR, LF, 00 and FF characters around a text.
inline constexpr std::size_t kMostAround = 8;

/// Returns the content of a whole message: for a tag its digits in upper case, for a text the
/// characters between start and end, without blanks at both ends. Fails if the text has characters
/// that are not ASCII, as with a wrong parity.
Result<std::string> Decode(View frame, const Settings& settings);

/// Parses the address of a reader: "none", or a number from 1 to 255. The number is for people
/// only: readers have no address.
Result<int> ParseAddress(std::string_view text);

}  // namespace baudgate::protocols::reader
