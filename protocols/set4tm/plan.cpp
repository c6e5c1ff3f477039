// Groups points into requests, and finds the points that a reply serves.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/plan.h"

#include <algorithm>
#include <map>

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/snapshot.h"

namespace baudgate::protocols::set4tm {

Plan::Plan(std::span<const config::Point> points) : points_(points) {
  fields_.reserve(points.size());
  for (const config::Point& point : points) {
    auto field = ParseField(point.read);
    fields_.push_back(field ? std::optional(std::move(*field)) : std::nullopt);
  }
}

void Plan::Make(const std::set<Bytes>& unsupported, bool snapshot) {
  queries_.clear();
  pdus_.clear();
  std::set<std::size_t> planned;
  if (snapshot) {
    for (const auto group : {config::Group::fast, config::Group::slow, config::Group::once}) {
      planned.merge(AddSnapshots(group));
    }
  }
  for (std::size_t point = 0; point < points_.size(); ++point) {
    if (!fields_[point] || planned.contains(point)) continue;
    const Bytes& pdu = fields_[point]->pdu;
    if (!unsupported.contains(pdu)) AddQuery(points_[point].group, pdu, point);
  }
}

void Plan::AddQuery(config::Group group, Bytes pdu, std::size_t point) {
  for (std::size_t i = 0; i < queries_.size(); ++i) {
    if (queries_[i].group == group && pdus_[i] == pdu) {
      queries_[i].points.push_back(point);
      return;
    }
  }
  queries_.push_back({group, {point}});
  pdus_.push_back(std::move(pdu));
}

std::optional<unsigned> Plan::BitOf(std::size_t point) const {
  const auto& field = fields_[point];
  if (!field || field->decoder != Decoder::float_le) return std::nullopt;
  const auto parameter = ParameterAt(field->pdu, field->offset);
  return parameter ? MaskBit(*parameter) : std::nullopt;
}

std::set<std::size_t> Plan::AddSnapshots(config::Group group) {
  std::map<unsigned, std::vector<std::size_t>> by_bit;
  for (std::size_t point = 0; point < points_.size(); ++point) {
    const auto bit = points_[point].group == group ? BitOf(point) : std::nullopt;
    if (bit) by_bit[*bit].push_back(point);
  }
  std::set<std::size_t> planned;
  if (by_bit.size() < 2) return planned;  // one value alone is cheaper as 08 1B
  std::vector<unsigned> bits;
  Query query{group, {}};
  const auto flush = [&] {
    if (bits.empty()) return;
    queries_.push_back(query);
    pdus_.push_back(MaskRequest(0, bits));
    bits.clear();
    query.points.clear();
  };
  for (const auto& [bit, points] : by_bit) {
    bits.push_back(bit);
    query.points.insert(query.points.end(), points.begin(), points.end());
    planned.insert(points.begin(), points.end());
    if (bits.size() == kMostMaskedFloats) flush();
  }
  flush();
  return planned;
}

std::vector<Match> Plan::Matches(View pdu) const {
  std::vector<Match> matches;
  const std::vector<unsigned> bits = MaskBits(pdu);
  for (std::size_t point = 0; point < points_.size(); ++point) {
    if (!fields_[point]) continue;
    if (std::ranges::equal(fields_[point]->pdu, pdu)) {
      matches.push_back({point, *fields_[point], {}});
    } else if (!bits.empty()) {
      const auto bit = BitOf(point);
      const auto at = bit ? std::ranges::find(bits, *bit) : bits.end();
      if (at == bits.end()) continue;
      Field field = *fields_[point];
      field.offset = 1 + 4 * static_cast<std::size_t>(at - bits.begin());
      matches.push_back({point, std::move(field), {}});
    }
  }
  if (!matches.empty()) return matches;
  for (Field& field : UsualFields(pdu)) {
    std::string label = FieldText(field);
    matches.push_back({kNoPoint, std::move(field), std::move(label)});
  }
  return matches;
}

}  // namespace baudgate::protocols::set4tm
