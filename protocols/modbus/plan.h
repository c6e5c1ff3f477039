// Which requests read a device's points: neighbours of one table and group share one, with the
// registers between them, as far as the device lets them. Points come from the configuration,
// refusals from the conversation.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "config/model/point.h"
#include "protocols/conversation.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/settings.h"

namespace baudgate::protocols::modbus {

/// What one request reads.
struct Block {
  Table table = Table::holding;
  std::uint16_t address = 0;
  std::size_t count = 0;  ///< registers or bits

  std::size_t end() const { return std::size_t{address} + count; }
  bool Covers(const Place& place) const {
    return place.table == table && place.address >= address && place.end() <= end();
  }
};

class Plan {
 public:
  /// `points` outlive the plan.
  Plan(std::span<const config::Point> points, const Settings& settings);

  std::span<const Query> queries() const { return queries_; }
  /// Of queries()[query].
  const Block& block(std::size_t query) const { return blocks_[query]; }
  /// Where the point is read; nothing when it is not.
  const std::optional<Place>& place(std::size_t point) const { return places_[point]; }

  /// The device refuses the query: reads it in two parts from now on, for the life of the plan.
  /// False when its points can not be parted.
  bool Split(std::size_t query);
  /// The query is refused and can not be split: it is asked apart, and with the slow group. True
  /// when that is news.
  bool Demote(std::size_t query);
  /// It was answered. True when it had been demoted, and is not any more.
  bool Restore(std::size_t query);
  /// What was refused gets another chance; splits stay.
  void Forget();

 private:
  void Make();
  std::size_t BatchOf(std::size_t point) const;
  bool MayJoin(const Block& block, std::size_t point) const;
  bool IsCutBetween(const Block& block, std::size_t address) const;

  std::span<const config::Point> points_;
  std::size_t most_registers_;
  std::size_t hole_;
  std::vector<std::optional<Place>> places_;    // by point
  std::map<std::size_t, std::size_t> demoted_;  // points, and the batch they were refused in
  std::size_t batches_ = 0;
  std::set<std::pair<Table, std::size_t>> cuts_;  // no block holds addresses on both sides of one
  std::vector<Query> queries_;
  std::vector<Block> blocks_;
};

}  // namespace baudgate::protocols::modbus
