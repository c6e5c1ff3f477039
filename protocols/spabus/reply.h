// Replies of the SPA Bus: their text, their checksum in all its readings, and continued lines.
// Bytes come from the line through rules.h to the conversation; the twin makes them here, too.
// RuleOf says what a refusal (NACK 0-9) means and what to do about it, ContinuationChecksum has the
// reading of continued replies that a line uses, and Decode says what an exchange means.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "protocols/conversation.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/points.h"

namespace baudgate::protocols::spabus {

// What a refusal of a slave (NACK 0…9) means and what the master does about it.
// Codes come from ParseReply and end as outcomes and sentences for the log.

/// Codes of refusals that are met by their number: the message asks for too much; it is not
/// understood; not now, as while the password is closed.
inline constexpr int kTooComplicated = 3;
inline constexpr int kSyntax = 5;
inline constexpr int kNotNow = 7;
inline constexpr int kOtherError = 9;

struct NackRule {
  Outcome outcome = Outcome::refused;
  std::string_view meaning;  ///< with advice
  std::string_view remedy;   ///< for `baudgate status`
  Duration wait{};           ///< before the slave is asked again
  /// The slave may answer for the items one by one although it does not for all of them.
  bool worth_splitting = false;
  /// A single item that is refused so does not exist for us.
  bool missing = false;
  /// The slave looked at the message and judged it; a damaged or crowded-out one it did not.
  bool judged = true;
};

const NackRule& RuleOf(int code);

/// "NACK 6: some of the data does not exist in the device; …".
std::string Explain(int code);

/// Bits of Expectation::checksum. The first four say what the checksum of a reply continued over
/// several lines may cover; no public source settles it, so more than one may be accepted.
inline constexpr int kCoversAll = 1;         ///< a: from `<` to the last colon, `&` CR LF included
inline constexpr int kCoversNoLineEnds = 2;  ///< b: without CR and LF
inline constexpr int kCoversCharacters = 4;  ///< c: without `&`, CR and LF
inline constexpr int kCoversLastLine = 8;    ///< d: the last line only
inline constexpr int kCoversAny = 15;
inline constexpr int kLineFeedCovered = 16;   ///< the LF before `<` counts, too
inline constexpr int kWildcardAccepted = 32;  ///< XX in place of a checksum passes

/// The most bytes that a reply of all permitted lines has: each line with its CR and LF.
inline constexpr std::size_t kMaxReply = kMaxLines * (kLongestLine + 2) + 1;

struct Reply {
  unsigned slave = 0;
  char type = 'D';          ///< D, A or N
  std::string data;         ///< of D: lines joined, before splitting at '/'
  std::optional<int> nack;  ///< of N: 0…9, when a digit was found
  bool continued = false;   ///< came in several lines
  bool wildcard = false;    ///< XX instead of a checksum
};

/// Reads a frame from `<` to its CR or CR LF; syntax only. Nothing when it is not a reply.
std::optional<Reply> ParseReply(View frame);

/// Which kCovers… readings give the checksum that the frame carries; 0 = none.
int MatchingReadings(View frame, bool line_feed_covered);

/// Whether the checksum passes under the bits `accepted`.
bool ChecksumPasses(View frame, int accepted);

/// How a slave computes the checksums of its replies: one of kCovers…, with kLineFeedCovered or
/// not. The frames begin with LF and end in CR LF.
std::optional<Bytes> EncodeData(unsigned slave, std::string_view data, int reading);
Bytes EncodeAck(unsigned slave, int reading);
Bytes EncodeNack(unsigned slave, int code, int reading);

// Which reading of the checksum of continued replies the devices of a line use. Shared by
// their conversations; each match narrows it down.
class ContinuationChecksum {
 public:
  /// Bits that a reply may match from now on.
  int accepted() const { return accepted_; }
  /// A continued reply passed; `matching` are the readings under which it did.
  void Confirm(int matching);
  /// A reply was damaged. Three in a row, and what was learned may itself be the mistake.
  void Doubt();
  void Forget();
  /// The reading that is left: 'a' to 'd'; 0 while there are several.
  char letter() const;

 private:
  int accepted_ = kCoversAny;
  int doubts_ = 0;
};

// What one exchange means: the pure function behind live polling and `baudgate decode` alike.
// A request and the frame that answered it go in, an Answer comes out.
struct Exchange {
  Answer answer;
  std::optional<Command> command;  ///< what was asked, when the request could be read
  std::optional<int> nack;         ///< the code, when the right slave refused
  std::string data;                ///< of an answered read, as it came
};

/// Readings carry the index of each point of `points`, which are sorted by address, with the item's
/// address, or a label where there is none. A single item that the slave does not have gives one
/// reading of bad configuration.
Exchange Decode(View request, View frame, std::span<const ReadPoint> points);

/// What a write has set, value by value, with labels: "S21 written". Nothing of the password.
std::vector<Reading> WrittenBy(const Command& command);

}  // namespace baudgate::protocols::spabus
