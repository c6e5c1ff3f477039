// By which requests the points of one meter are read: floats together by mask (08 23), one by one
// (08 1B), or as integers where the type of the meter has no floats. Whether it knows masks is
// tried once:
//
//   > 05 08 23 01 00 …   in place of > 05 08 1B 00 11
//   < all values good    from now on by mask       < refused, silent, or a value missing   08 1B
//
// ReplyReader says what a frame means for its request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/model/device.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/meter/identification.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

// What a frame from a meter means for the request that it answers, whatever the session:
//
//   > 05 08 00 66 01   < 05 00 89 A2 61 …     data: the serial number
//   > 05 08 00 66 01   < 05 05 81 C3          status 05: the channel is closed
//

struct Reply {
  Answer answer;
  View pdu;                            ///< of the request; empty when the frame does not answer it
  std::optional<std::uint8_t> status;  ///< a one-byte reply
  View data;                           ///< any other
};

class ReplyReader {
 public:
  /// All outlive it.
  ReplyReader(const Settings& settings, const PointFields& fields,
              const Identification& identification)
      : settings_(settings), fields_(fields), identification_(identification) {}

  Reply Read(View request, View frame) const;
  /// See Conversation::Check.
  Outcome Check(View request, View frame) const;

 private:
  bool Accepts(View asked, View answering) const;
  void ReadStatus(Reply& reply) const;
  void ReadData(Reply& reply) const;

  const Settings& settings_;
  const PointFields& fields_;
  const Identification& identification_;
};

class PointReads {
 public:
  /// All outlive it.
  PointReads(const config::Device& device, const Settings& settings,
             const Identification& identification);

  std::span<const Query> Queries() const { return plan_.queries(); }
  const PointFields& fields() const { return fields_; }

  struct Read {
    Bytes pdu;
    bool tries_masks = false;
  };
  /// The request that reads a query. A masked read has no number yet.
  Read ReadOf(std::size_t query) const;
  /// The meter repeats the number of a masked read, so a late reply to the one before is found out.
  void Number(Bytes& pdu);
  /// Whether `pdu` reads the query as it is read when nothing is tried.
  bool Reads(View pdu, std::size_t query) const;
  /// What is kept by a latch, by query.
  bool ReadsLatched(std::size_t query) const;

  /// `answer` answers a read that tried masks.
  Answer TakeTrial(Answer answer);
  void EndTrial() { tries_masks_ = false; }
  /// As the type of the meter says. True: the queries are others now.
  bool ChooseIntegers();

  /// Older firmware refuses masked reads that a newer one knew: the points are not to blame.
  void OnMasksRefused() { UseMasks(false); }
  void OnRefused(std::size_t query, Instant now) { plan_.OnRefused(query, now); }
  // True: the queries are others now.

  bool OnAnswered(std::size_t query, Instant now) {
    return plan_.OnAnswered(query, now) != PlanChange::nothing;
  }
  bool OnHeard(std::size_t query, Instant now) {
    return plan_.OnHeard(query, now) != PlanChange::nothing;
  }
  /// Masked reads that were refused are tried again.
  void TryMasks() { tries_masks_ = MasksMayHelp(); }
  /// True: the queries are others now.
  bool ForgetRefusals();
  void OnReconnect();
  /// For the status; empty: nothing was learned.
  std::string Learned() const;

 private:
  void UseMasks(bool masked);
  /// Only where they save requests.
  bool MasksMayHelp() const;
  /// The masked read to try in place of the query.
  std::optional<Bytes> Trial(std::size_t query) const;

  const Settings& settings_;
  const Identification& identification_;
  PointFields fields_;
  const Often is_often_;
  PduPlan plan_;
  bool masked_ = false;       ///< floats are read by 08 23
  bool integers_ = false;     ///< integers are read in place of floats
  bool tries_masks_ = false;  ///< whether it knows that is not known yet
  std::uint8_t number_ = 0;   ///< of the latest masked read
};

}  // namespace baudgate::protocols::set4tm
