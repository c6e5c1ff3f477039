// Parses and encodes replies of the SPA Bus: text, checksum in all its variants, and continued
// lines. `RuleOf` explains a refusal (NACK 0-9) and how to react, `ContinuationChecksum` learns
// which checksum the continued replies of a line have, and `Decode` makes an answer of an exchange.
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

// NackRule is the meaning of a refusal of a slave (NACK 0…9), and the reaction of the master.

/// NACK codes with a special reaction: 3, the request asks for too much; 5, the request is not
/// understood; 7, the item cannot be read or written now, for example without the password; 9, any
/// other error.
inline constexpr int kTooComplicated = 3;
inline constexpr int kSyntax = 5;
inline constexpr int kNotNow = 7;
inline constexpr int kOtherError = 9;

struct NackRule {
  Outcome outcome = Outcome::refused;
  std::string_view meaning;  ///< meaning of the code for the log, with advice
  std::string_view remedy;   ///< advice for `baudgate status`
  Duration wait{};           ///< time for which the slave gets no request
  /// True: a slave that refuses a request for several items with this code may answer for single
  /// items.
  bool worth_splitting = false;
  /// True: a single item that is refused with this code does not exist in the device.
  bool missing = false;
  /// True: the slave has read the request. False: the request was damaged, or the slave was too
  /// busy to read it.
  bool judged = true;
};

const NackRule& RuleOf(int code);

std::string Explain(int code);

/// Bits of Expectation::checksum. The first four are variants of what the checksum of a continued
/// reply (a reply in several lines) covers. No public source defines this, so several variants can
/// be accepted.
inline constexpr int kCoversAll = 1;         ///< a: from `<` to the last colon, with `&`, CR and LF
inline constexpr int kCoversNoLineEnds = 2;  ///< b: as a, without CR and LF
inline constexpr int kCoversCharacters = 4;  ///< c: as a, without `&`, CR and LF
inline constexpr int kCoversLastLine = 8;    ///< d: the last line only
inline constexpr int kCoversAny = 15;
inline constexpr int kLineFeedCovered = 16;  ///< the checksum also covers the LF before `<`
/// A reply with XX in place of the checksum is accepted.
inline constexpr int kWildcardAccepted = 32;

/// The maximum number of bytes in a reply: all lines have their maximum length, with CR and LF.
inline constexpr std::size_t kMaxReply = kMaxLines * (kLongestLine + 2) + 1;

struct Reply {
  unsigned slave = 0;
  char type = 'D';          ///< type of the reply: D (data), A (acknowledged) or N (refused)
  std::string data;         ///< data of type D: the joined lines, before they are split at '/'
  std::optional<int> nack;  ///< code of type N, 0…9; empty: no digit was found
  bool continued = false;
  bool wildcard = false;
};

/// Parses a frame from `<` to its CR or CR LF. It checks the syntax, not the checksum. Returns
/// nothing if the frame is not a reply.
std::optional<Reply> ParseReply(View frame);

/// Returns the variants kCovers… under which the checksum of the frame is right, as bits; 0: no
/// variant fits.
int MatchingReadings(View frame, bool line_feed_covered);

bool ChecksumPasses(View frame, int accepted);

/// EncodeData, EncodeAck and EncodeNack encode replies; their frames begin with LF and end in CR
/// LF. `reading`: how the slave computes checksums, one of kCovers…, with or without
/// kLineFeedCovered. EncodeData returns nothing if the data needs more than kMaxLines lines.
std::optional<Bytes> EncodeData(unsigned slave, std::string_view data, int reading);
Bytes EncodeAck(unsigned slave, int reading);
Bytes EncodeNack(unsigned slave, int code, int reading);

// ContinuationChecksum learns which variant of the checksum the continued replies of a line have.
// The conversations of a line share it; each matching reply excludes variants.
class ContinuationChecksum {
 public:
  int accepted() const { return accepted_; }
  /// Call it if a continued reply was right under the variants `matching`.
  void Confirm(int matching);
  /// Call it if a reply was damaged. After three damaged replies in a row all variants are accepted
  /// again, because the learned variant may be wrong.
  void Doubt();
  void Forget();
  /// Returns the letter of the learned variant, 'a' to 'd'; 0 while several variants are possible.
  char letter() const;

 private:
  int accepted_ = kCoversAny;
  int doubts_ = 0;
};

// Exchange is a decoded request with its reply. Decode depends on these two alone; polls and
// `baudgate decode` use it.
struct Exchange {
  Answer answer;
  std::optional<Command> command;  ///< the request; empty: the request could not be parsed
  std::optional<int> nack;         ///< the code of the refusal, if the requested slave has refused
  std::string data;                ///< the data in the reply to a read, as received
};

/// Decodes a request with its reply. `points` must be sorted by address. Each reading has the index
/// of a point with the item's address, or a label if no point has it. A single item that the slave
/// does not have gives one reading with the quality bad_configuration.
Exchange Decode(View request, View frame, std::span<const ReadPoint> points);

/// Returns the values that a write has set as readings with labels: "S21 written". Items of the
/// password are left out.
std::vector<Reading> WrittenBy(const Command& command);

}  // namespace baudgate::protocols::spabus
