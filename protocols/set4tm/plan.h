// Which requests read a device's points, and which points a reply to a request serves: points of
// one PDU share an exchange, float parameters may share one masked read (08 23).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/point.h"
#include "protocols/common/query_plan.h"
#include "protocols/set4tm/points.h"

namespace baudgate::protocols::set4tm {

/// A point whose value a reply holds, and where it stands there.
struct Match {
  std::size_t point = kNoPoint;
  Field field;
};

/// Keys are the PDUs of requests; that of masked reads is 08 23, and its places are mask bits.
using PduPlan = QueryPlan<Bytes>;

/// The fields of a device's points, parsed once.
class PointFields {
 public:
  /// `points` outlive it.
  explicit PointFields(std::span<const config::Point> points);

  /// Whether live floats are among them.
  bool HasFloats() const;
  std::optional<Decoder> DecoderOf(std::size_t point) const {
    const auto& field = fields_[point];
    return field ? std::optional(field->decoder) : std::nullopt;
  }
  /// Integers in place of floats, for meters that have none (integers.h), or as points say.
  void UseIntegers(bool integers);

  /// How they are read. `masked`: a group's live floats together, up to 23 in one masked read.
  PduPlan MakePlan(bool masked, Often is_often = IsFast) const;
  /// The PDU of a query of such a plan; the id byte of a masked read is 0.
  Bytes PduOf(const PduPlan& plan, std::size_t query) const;
  /// Every point whose value stands in the reply to `pdu`, with its place there.
  std::vector<Match> Matches(View pdu) const;

 private:
  /// The mask bit that can stand for the point.
  std::optional<unsigned> BitOf(std::size_t point) const;
  /// Points of the group that masked reads serve.
  std::vector<std::size_t> MaskedPoints(config::Group group) const;

  std::span<const config::Point> points_;
  std::vector<std::optional<Field>> fields_;  // by point
};

}  // namespace baudgate::protocols::set4tm
