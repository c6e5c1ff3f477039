// Plans which requests read a device's points, and finds the points whose values a reply contains.
// Points with the same PDU share a request; float parameters can share one masked read (08 23).
// MaskRequest builds a masked read, and AsInteger returns the integer field that replaces a float.
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

// MaskBit and the functions below it define by which bits the mask of 08 23 (reference, 9.8)
// selects float parameters, so that one exchange reads many values.

/// The maximum number of floats in a masked read: 1 + 23 * 4 data bytes fill a frame of 96 bytes.
inline constexpr std::size_t kMostMaskedFloats = 23;

/// Returns the parameter (RWRI byte of 08 1B) of the value at `offset` in the reply to `pdu`, if
/// `pdu` reads a single present float or a group of them; else nothing. The first value of a group
/// is the sum, or repeats phase 1.
std::optional<std::uint8_t> ParameterAt(View pdu, std::size_t offset);

/// Returns the bit of a parameter in the mask (0: the lowest bit of m8, the last byte), or nothing
/// if it has none.
std::optional<unsigned> MaskBit(std::uint8_t parameter);
std::optional<std::uint8_t> MaskedParameter(unsigned bit);

bool IsMasked(View pdu);
/// Returns the PDU that reads the parameters of these bits: 08 23 id 00 m1…m8.
Bytes MaskRequest(std::uint8_t id, const std::vector<unsigned>& bits);
/// Returns the bits in the PDU of a masked read. The values in the reply have the same order.
std::vector<unsigned> MaskBits(View pdu);

// IntegerDecoder and AsInteger replace float values by integer fields, for meters without floats:
// SET-4TM.02 and older (reference, 9.5 to 9.7).
//
//   08 1B 02 10 float_le@4  →  08 16 10 voltage_be@3     voltage of phase 1, in a group of four
//   08 1B 00 40 float_le@0  →  08 11 40 hundredths_be@0  frequency, single

/// Returns the decoder for the integer value of a parameter (RWRI byte) in replies to 08 11, 08 14
/// and 08 16.
Decoder IntegerDecoder(std::uint8_t parameter);

/// Returns the integer field with the same quantity as `field`, a float that is not latched. Empty:
/// `field` is not such a float.
std::optional<Field> AsInteger(const Field& field);

struct Match {
  std::size_t point = kNoPoint;
  Field field;
};

/// A plan of the requests to a meter. Its keys are PDUs; all masked reads have the key 08 23, and
/// their places are mask bits.
using PduPlan = QueryPlan<Bytes>;

class PointFields {
 public:
  explicit PointFields(std::span<const config::Point> points);

  bool HasFloats() const;
  std::optional<Decoder> DecoderOf(std::size_t point) const {
    const auto& field = fields_[point];
    return field ? std::optional(field->decoder) : std::nullopt;
  }
  /// Replaces float fields by integer fields, or restores the fields of the points.
  void UseIntegers(bool integers);

  /// Plans the requests. `masked`: true if masked reads are used; the floats of a group that are
  /// not latched are then read together, up to 23 in one request.
  PduPlan MakePlan(bool masked, Often is_often = IsFast) const;
  /// Returns the PDU of a query in `plan`. The id byte of a masked read is 0 there.
  Bytes PduOf(const PduPlan& plan, std::size_t query) const;
  std::vector<Match> Matches(View pdu) const;

 private:
  /// Returns the mask bit that reads the point. Empty: a masked read cannot read the point.
  std::optional<unsigned> BitOf(std::size_t point) const;
  std::vector<std::size_t> MaskedPoints(config::Group group) const;

  void Index();

  std::span<const config::Point> points_;
  std::vector<std::optional<Field>> fields_;
  std::multimap<Bytes, std::size_t> by_pdu_;
  std::multimap<unsigned, std::size_t> by_bit_;
};

}  // namespace baudgate::protocols::set4tm
