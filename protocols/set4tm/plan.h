// Which requests read a device's points, and which points a reply to a request serves: points of
// one PDU share an exchange, float parameters may share one masked read (08 23).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "config/model/point.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/points.h"

namespace baudgate::protocols::set4tm {

/// A value that a reply holds: of a point, or with a label where no point asks for it.
struct Match {
  std::size_t point = kNoPoint;
  Field field;
  std::string label;
};

class Plan {
 public:
  explicit Plan(std::span<const config::Point> points);

  /// Makes the queries anew, without the PDUs that the meter does not know.
  void Make(const std::set<Bytes>& unsupported, bool snapshot);

  std::span<const Query> queries() const { return queries_; }
  /// Of queries()[query]; the id byte of a masked read is 0.
  const Bytes& pdu(std::size_t query) const { return pdus_[query]; }
  /// Every point whose value stands in the reply to `pdu`, with its place there.
  std::vector<Match> Matches(View pdu) const;

 private:
  void AddQuery(config::Group group, Bytes pdu, std::size_t point);
  std::set<std::size_t> AddSnapshots(config::Group group);
  /// The mask bit that can stand for the point.
  std::optional<unsigned> BitOf(std::size_t point) const;

  std::span<const config::Point> points_;
  std::vector<std::optional<Field>> fields_;  // by point
  std::vector<Query> queries_;
  std::vector<Bytes> pdus_;
};

}  // namespace baudgate::protocols::set4tm
