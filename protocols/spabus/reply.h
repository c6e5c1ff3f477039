// Parses and encodes replies of the SPA Bus: text, checksum in all its variants, and continued
// lines. `RuleOf` explains a refusal (NACK 0-9) and how to react, `ContinuationChecksum` learns
// which checksum the continued replies of a line have, and `Decode` turns an exchange into an
// answer.
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

// Refusals of a slave (NACK 0…9): what each code means, and how the master reacts.

/// Codes that are handled by number: the request asks for too much; it is not understood; not now,
/// for example without the password.
inline constexpr int kTooComplicated = 3;
inline constexpr int kSyntax = 5;
inline constexpr int kNotNow = 7;
inline constexpr int kOtherError = 9;

struct NackRule {
  Outcome outcome = Outcome::refused;
  std::string_view meaning;  ///< for the log, with advice
  std::string_view remedy;   ///< advice for `baudgate status`
  Duration wait{};           ///< time before the slave is asked again
  /// The slave may answer for single items although it refuses a request for several.
  bool worth_splitting = false;
  /// A single item that is refused with this code does not exist in the device.
  bool missing = false;
  /// The slave has read the request. False: the request was damaged, or the slave was too busy to
  /// read it.
  bool judged = true;
};

const NackRule& RuleOf(int code);

/// Returns "NACK 6: some of the data does not exist in the device; …".
std::string Explain(int code);

/// Bits of Expectation::checksum. The first four are variants of what the checksum of a continued
/// reply covers (a reply in several lines). No public source defines it, so several variants may be
/// accepted.
inline constexpr int kCoversAll = 1;         ///< a: from `<` to the last colon, with `&`, CR and LF
inline constexpr int kCoversNoLineEnds = 2;  ///< b: without CR and LF
inline constexpr int kCoversCharacters = 4;  ///< c: without `&`, CR and LF
inline constexpr int kCoversLastLine = 8;    ///< d: the last line only
inline constexpr int kCoversAny = 15;
inline constexpr int kLineFeedCovered = 16;   ///< the LF before `<` is covered, too
inline constexpr int kWildcardAccepted = 32;  ///< XX in place of a checksum is accepted

/// The most bytes of a reply with the largest number of lines, each with its CR and LF.
inline constexpr std::size_t kMaxReply = kMaxLines * (kLongestLine + 2) + 1;

struct Reply {
  unsigned slave = 0;
  char type = 'D';          ///< D, A or N
  std::string data;         ///< data of D: the lines joined, before splitting at '/'
  std::optional<int> nack;  ///< code of N: 0…9; empty: no digit was found
  bool continued = false;
  bool wildcard = false;
};

/// Parses a frame from `<` to its CR or CR LF; checks the syntax only. Returns nothing if the frame
/// is no reply.
std::optional<Reply> ParseReply(View frame);

/// Returns which kCovers… variants give the checksum of the frame; 0: none.
int MatchingReadings(View frame, bool line_feed_covered);

bool ChecksumPasses(View frame, int accepted);

/// `reading`: how the slave computes checksums, one of kCovers…, with or without kLineFeedCovered.
/// The frames begin with LF and end in CR LF. EncodeData returns nothing if the data is too long.
std::optional<Bytes> EncodeData(unsigned slave, std::string_view data, int reading);
Bytes EncodeAck(unsigned slave, int reading);
Bytes EncodeNack(unsigned slave, int code, int reading);

// Learns which variant of the checksum the continued replies of a line have. The conversations of a
// line share it; each matching reply excludes variants.
class ContinuationChecksum {
 public:
  /// Returns the variants that a reply may have from now on.
  int accepted() const { return accepted_; }
  /// A continued reply was right under the variants `matching`.
  void Confirm(int matching);
  /// A reply was damaged. After three in a row all variants are accepted again, because the learned
  /// one may be wrong.
  void Doubt();
  void Forget();
  /// Returns the remaining variant, 'a' to 'd'; 0 while several remain.
  char letter() const;

 private:
  int accepted_ = kCoversAny;
  int doubts_ = 0;
};

// The meaning of one exchange. Decode is a pure function from a request and its reply; live polling
// and `baudgate decode` both use it.
struct Exchange {
  Answer answer;
  std::optional<Command> command;  ///< the request; empty: it could not be parsed
  std::optional<int> nack;         ///< the code, if the right slave refused
  std::string data;                ///< the data of an answered read, as it came
};

/// `points` must be sorted by address. Readings have the index of each point with the item's
/// address, or a label if there is none. A single item that the slave does not have gives one
/// reading of bad configuration.
Exchange Decode(View request, View frame, std::span<const ReadPoint> points);

/// Returns what a write has set, value by value, with labels: "S21 written". Items of the password
/// are left out.
std::vector<Reading> WrittenBy(const Command& command);

}  // namespace baudgate::protocols::spabus
