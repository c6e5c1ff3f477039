// Which requests read a device's points, and which points a reply to a request serves: points of
// one PDU share an exchange, float parameters may share one masked read (08 23). MaskRequest makes
// a masked read, and AsInteger gives the integer that stands for a float.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "protocols/common/query_plan.h"
#include "protocols/set4tm/meter/points.h"

namespace baudgate::protocols::set4tm {

// Which float parameter stands at which bit of the 08 23 mask (reference, 9.8), so that many values
// come in one exchange. Used by the planner, by the decoder and by the twin.

/// 1 + 23 * 4 data bytes fill the 96 bytes of a frame.
inline constexpr std::size_t kMostMaskedFloats = 23;

/// The parameter (RWRI byte of 08 1B) that stands at `offset` of the reply to `pdu`, when that is a
/// live float read, single or group; in group replies slot 0 is the sum, or repeats phase 1.
std::optional<std::uint8_t> ParameterAt(View pdu, std::size_t offset);

/// 0 is the lowest bit of the last mask byte. Nothing where the mask has no place for the
/// parameter.
std::optional<unsigned> MaskBit(std::uint8_t parameter);
std::optional<std::uint8_t> MaskedParameter(unsigned bit);

/// Whether the request is an 08 23.
bool IsMasked(View pdu);
/// The PDU that asks for these bits: 08 23 id 00 m1…m8.
Bytes MaskRequest(std::uint8_t id, const std::vector<unsigned>& bits);
/// The bits that a 08 23 PDU asks for, in the order of the reply's values.
std::vector<unsigned> MaskBits(View pdu);

// The integer that stands for a float value, for meters that have no floats: SET-4TM.02 and older
// ones (reference, 9.5 to 9.7). Used by the plan, by the twin and by `baudgate decode`.
//
//   08 1B 02 10 float_le@4  →  08 16 10 voltage_be@3     voltage of phase 1, four together
//   08 1B 00 40 float_le@0  →  08 11 40 hundredths_be@0  frequency, alone

/// Decodes the integer that 08 11, 08 14 and 08 16 give for a parameter (RWRI byte).
Decoder IntegerDecoder(std::uint8_t parameter);

/// Empty: it is no live float.
std::optional<Field> AsInteger(const Field& field);

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
  /// Integers in place of floats, for meters that have none, or as points say.
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

  /// Finds the points of each request.
  void Index();

  std::span<const config::Point> points_;
  std::vector<std::optional<Field>> fields_;  // by point
  std::multimap<Bytes, std::size_t> by_pdu_;
  std::multimap<unsigned, std::size_t> by_bit_;  // of the mask
};

}  // namespace baudgate::protocols::set4tm
