// Groups points into requests, and finds the points that a reply serves.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/plan.h"

#include <algorithm>
#include <set>

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/integers.h"
#include "protocols/set4tm/snapshot.h"

namespace baudgate::protocols::set4tm {
namespace {

const Bytes kMasked = {kRead, kFloatMask};

}  // namespace

PointFields::PointFields(std::span<const config::Point> points) : points_(points) {
  fields_.reserve(points.size());
  for (const config::Point& point : points) {
    auto field = ParseField(point.read);
    fields_.push_back(field ? std::optional(std::move(*field)) : std::nullopt);
  }
}

bool PointFields::HasFloats() const {
  return std::ranges::any_of(
      fields_, [](const auto& field) { return field && AsInteger(*field).has_value(); });
}

void PointFields::UseIntegers(bool integers) {
  PointFields said(points_);
  fields_ = std::move(said.fields_);
  if (!integers) return;
  for (auto& field : fields_) {
    if (field) field = AsInteger(*field).value_or(std::move(*field));
  }
}

PduPlan PointFields::MakePlan(bool masked, Often is_often) const {
  PduPlan plan({.may_join =
                    [](const Block<Bytes>& block, const Block<Bytes>&) {
                      return block.key == kMasked && block.items < kMostMaskedFloats;
                    },
                .reads_between = [](const Bytes& key) { return key != kMasked; },
                .refused = WhenRefused::drop,
                .is_often = std::move(is_often)});
  std::set<std::size_t> planned;
  for (std::size_t number = masked ? config::kGroups : 0; number-- > 0;) {
    const auto group = static_cast<config::Group>(number);
    for (const std::size_t point : MaskedPoints(group)) {
      const std::size_t bit = *BitOf(point);
      plan.Add(group, point, kMasked, bit, bit + 1);
      planned.insert(point);
    }
  }
  for (std::size_t point = 0; point < points_.size(); ++point) {
    if (!fields_[point] || planned.contains(point)) continue;
    plan.Add(points_[point].group, point, fields_[point]->pdu);
  }
  plan.Make();
  return plan;
}

std::vector<std::size_t> PointFields::MaskedPoints(config::Group group) const {
  std::vector<std::size_t> points;
  std::set<unsigned> bits;
  for (std::size_t point = 0; point < points_.size(); ++point) {
    const auto bit = points_[point].group == group ? BitOf(point) : std::nullopt;
    if (!bit) continue;
    points.push_back(point);
    bits.insert(*bit);
  }
  if (bits.size() < 2) points.clear();  // one value alone is cheaper as 08 1B
  return points;
}

Bytes PointFields::PduOf(const PduPlan& plan, std::size_t query) const {
  const Bytes& key = plan.block(query).key;
  if (key != kMasked) return key;
  std::vector<unsigned> bits;
  for (const std::size_t point : plan.queries()[query].points) bits.push_back(*BitOf(point));
  return MaskRequest(0, bits);
}

std::optional<unsigned> PointFields::BitOf(std::size_t point) const {
  const auto& field = fields_[point];
  if (!field || field->decoder != Decoder::float_le) return std::nullopt;
  const auto parameter = ParameterAt(field->pdu, field->offset);
  return parameter ? MaskBit(*parameter) : std::nullopt;
}

std::vector<Match> PointFields::Matches(View pdu) const {
  std::vector<Match> matches;
  const std::vector<unsigned> bits = MaskBits(pdu);
  for (std::size_t point = 0; point < points_.size(); ++point) {
    if (!fields_[point]) continue;
    if (std::ranges::equal(fields_[point]->pdu, pdu)) {
      matches.push_back({point, *fields_[point]});
    } else if (!bits.empty()) {
      const auto bit = BitOf(point);
      const auto at = bit ? std::ranges::find(bits, *bit) : bits.end();
      if (at == bits.end()) continue;
      Field field = *fields_[point];
      field.offset = 1 + 4 * static_cast<std::size_t>(at - bits.begin());
      matches.push_back({point, std::move(field)});
    }
  }
  return matches;
}

}  // namespace baudgate::protocols::set4tm
