// PointReads decides which requests read the points of one meter: floats together by mask (08 23),
// one by one (08 1B), or as integers if the meter's type has no floats. It tries once whether the
// meter supports masks:
//
//   > 05 08 23 01 00 …   in place of > 05 08 1B 00 11
//   < all values good: read by mask from now on       < refused, silent, or a value missing: 08 1B
//
// ReplyReader decodes replies.
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

// ReplyReader decodes the reply to a request, without the state of the session:
//
//   > 05 08 00 66 01   < 05 00 89 A2 61 …     data: the serial number
//   > 05 08 00 66 01   < 05 05 81 C3          status 05: the channel is closed

struct Reply {
  Answer answer;
  View pdu;  ///< PDU of the request; empty if the frame does not answer the request
  std::optional<std::uint8_t> status;  ///< set if the reply is one byte, a status
  View data;                           ///< the data, if the reply is not a status
};

class ReplyReader {
 public:
  ReplyReader(const Settings& settings, const PointFields& fields,
              const Identification& identification)
      : settings_(settings), fields_(fields), identification_(identification) {}

  Reply Read(View request, View frame) const;
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
  PointReads(const config::Device& device, const Settings& settings,
             const Identification& identification);

  std::span<const Query> Queries() const { return plan_.queries(); }
  const PointFields& fields() const { return fields_; }

  struct Read {
    Bytes pdu;
    bool tries_masks = false;
  };
  /// Returns the request that reads a query. The id byte of a masked read is not set yet, see
  /// Number.
  Read ReadOf(std::size_t query) const;
  /// Sets the id byte of a masked read. The meter repeats the id, so a late reply is detected.
  void Number(Bytes& pdu);
  /// True if `pdu` is the planned request of the query, not a trial of a masked read.
  bool Reads(View pdu, std::size_t query) const;
  bool ReadsLatched(std::size_t query) const;

  Answer TakeTrial(Answer answer);
  void EndTrial() { tries_masks_ = false; }
  /// Chooses floats or integers by the meter's type. Returns true if the queries have changed.
  bool ChooseIntegers();

  /// Call it if a planned masked read was refused (older firmware). The points are then read one by
  /// one.
  void OnMasksRefused() { UseMasks(false); }
  void OnRefused(std::size_t query, Instant now) { plan_.OnRefused(query, now); }
  // OnAnswered, OnHeard and ForgetRefusals return true if the queries have changed.

  bool OnAnswered(std::size_t query, Instant now) {
    return plan_.OnAnswered(query, now) != PlanChange::nothing;
  }
  bool OnHeard(std::size_t query, Instant now) {
    return plan_.OnHeard(query, now) != PlanChange::nothing;
  }
  void TryMasks() { tries_masks_ = MasksMayHelp(); }
  bool ForgetRefusals();
  void OnReconnect();
  /// Returns a text for the status: what was learned about reading. Empty: nothing was learned.
  std::string Learned() const;

 private:
  void UseMasks(bool masked);
  /// True if masked reads are allowed and would save requests.
  bool MasksMayHelp() const;
  /// Returns the masked read to try in place of the query. Empty: no masked read is tried.
  std::optional<Bytes> Trial(std::size_t query) const;

  const Settings& settings_;
  const Identification& identification_;
  PointFields fields_;
  const Often is_often_;
  PduPlan plan_;
  bool masked_ = false;
  bool integers_ = false;
  bool tries_masks_ = false;  ///< true: it is not known yet whether the meter supports masked reads
  std::uint8_t number_ = 0;   ///< id of the latest masked read
};

}  // namespace baudgate::protocols::set4tm
