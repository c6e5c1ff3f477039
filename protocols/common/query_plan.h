// `QueryPlan` decides which requests read a device's points. Neighbouring points share a request.
// Points that the device refuses are asked in smaller requests, rarely, or not at all. The
// conversation reports the results of requests; the plan sees no bytes.
// A device that is starting up may refuse everything for a while. So for an hour, points that have
// answered before are asked again every few seconds, and split requests are tried as a whole again.
// TryAgain computes when a refused request is tried again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "protocols/conversation.h"

namespace baudgate::protocols {

// TryAgain is the retry timer for something that a device has refused. The first retry comes soon,
// because the device may be starting up; later retries become less and less frequent.
//
//   refused at 0 s    tried and refused at 8 s, 24 s, 56 s …, at last once an hour
//
class TryAgain {
 public:
  static constexpr Duration kLongest = 1h;

  explicit TryAgain(Duration first = 8s) : first_(first) {}

  /// Call it when the device has refused. Starts the first wait, or a wait twice as long as the
  /// previous one (at most kLongest). Has no effect while a wait is running.
  void OnRefused(Instant now) {
    if (at_ && now < *at_) return;
    wait_ = wait_ == Duration::zero() ? first_ : std::min(2 * wait_, kLongest);
    at_ = now + wait_;
  }
  bool IsDue(Instant now) const { return at_ && now >= *at_; }
  /// Returns true if the wait is over, and ends it, so that the next call returns false.
  bool TakeDue(Instant now) {
    if (!IsDue(now)) return false;
    at_.reset();
    return true;
  }
  void Forget() { *this = TryAgain(first_); }

 private:
  Duration first_;
  Duration wait_{};
  std::optional<Instant> at_{};  // end of the wait; empty: no wait is running
};

/// The part of a device that one request reads: positions `begin` to `end` (exclusive) of one
/// `key`. Example: registers 200…203 of the table of holding registers. For a key without
/// positions, such as a command, it is position 0.
template <typename Key>
struct Block {
  Key key{};
  std::size_t begin = 0;
  std::size_t end = 1;
  /// Number of separate items in the block. Example: registers 7, 8 and 20 are 3 items in 14
  /// positions.
  std::size_t items = 1;

  std::size_t size() const { return end - begin; }
  bool Covers(const Block& other) const {
    return key == other.key && other.begin >= begin && other.end <= end;
  }
};

/// How often the points are asked that the device refuses. The rule applies at once to points that
/// were never answered. Points that were answered before are first asked every few seconds
/// (config::Group::again) for an hour; then the rule applies to them.
enum class WhenRefused : std::uint8_t {
  /// Refused points are asked with the slow group, or seldomer if their own group is `daily` or
  /// `once`. So a channel that is enabled later returns by itself.
  ask_rarely,
  /// Like ask_rarely, but after Rules::refusals refusals a point that was never answered is asked
  /// once a day.
  ask_daily,
  drop,  ///< points that were never answered are not asked until OnReconnect
};

using Often = std::function<bool(config::Group)>;
constexpr bool IsFast(config::Group group) { return group >= config::Group::fast; }
inline Often OftenOf(const config::Device& device) {
  return [&device](config::Group group) { return config::IsOften(device, group); };
}

/// The change of the plan after the result of a request. Unless it is `nothing`, queries() has
/// changed.
enum class PlanChange : std::uint8_t {
  nothing,
  split,      ///< the request is read in two parts from now on
  set_apart,  ///< the points of the request are asked rarely, or not at all
  restored,   ///< points that were set apart are asked with their group again
};

/// Plans the queries of one device. A Query (protocols/conversation.h) lists the points that one
/// request reads. Queries are sorted by group (fast, slow, once, again), then by the order in which
/// keys were first added. Queries without refusal come before refused ones, and lower positions
/// before higher. The index of a query is valid until a call returns a change, or until Make or
/// OnReconnect.
template <typename Key>
class QueryPlan {
 public:
  struct Rules {
    /// True if a request for `block` is allowed to read `next` as well. `next` has the same key,
    /// begins inside `block` or behind it, and is not wholly inside. Null: blocks are never joined.
    std::function<bool(const Block<Key>& block, const Block<Key>& next)> may_join{};
    /// True if a request for this key reads all positions from its first to its last, also
    /// positions that belong to no point. False if it reads only the positions of its points. Null:
    /// always true.
    std::function<bool(const Key& key)> reads_between{};
    WhenRefused refused = WhenRefused::ask_rarely;
    /// The number of refusals in a row after which the device is assumed not to have a point. It is
    /// more than 1 if a damaged reply can look like a refusal. For points that were answered
    /// before, fewer refusals count as ordinary failures.
    int refusals = 1;
    /// True if the group is polled at least as often as config::Group::again. A refused point of
    /// such a group stays in its group, because the next poll is a retry that is soon enough.
    Often is_often = IsFast;
  };

  explicit QueryPlan(Rules rules) : rules_(std::move(rules)) {}

  /// Adds a read of the point with index `point` at positions `begin` to `end` (exclusive) of
  /// `key`. Points that are never read must not be added.
  void Add(config::Group group, std::size_t point, const Key& key, std::size_t begin = 0,
           std::size_t end = 1);
  /// Computes the queries. Call it after the last Add, and when the answers of may_join have
  /// changed.
  void Make();

  std::span<const Query> queries() const { return queries_; }
  const Block<Key>& block(std::size_t query) const { return blocks_[query]; }
  /// True if every point of the query has been answered at least once, no matter when.
  bool IsProven(std::size_t query) const;

  /// Marks points as answered that were answered in `other`, a plan with another layout of the same
  /// points.
  void TakeProven(const QueryPlan& other);

  // The functions below report the result of queries()[query]. An index beyond the last query has
  // no effect.

  /// Call it when the reply has values. The points of the query are asked with their group again.
  PlanChange OnAnswered(std::size_t query, Instant now);
  /// Call it when the reply is a message such as "busy" or "failure", which does not mean that the
  /// device lacks the points. Points that were answered before and whose group is not polled often
  /// are then retried sooner.
  PlanChange OnHeard(std::size_t query, Instant now);
  /// Call it when the reply means that the device lacks at least one item of the query. If the
  /// query can be split, it is split at its widest gap, or else in the middle, so that one bad item
  /// does not block the others. `divisible`: false if parts would be refused as well (an unknown
  /// function). After many refusals in a row the device is assumed to accept nothing at present,
  /// and a query that was answered before is then set apart as a whole.
  PlanChange OnRefused(std::size_t query, Instant now, bool divisible = true);
  /// True if one more refusal of the query is enough to assume that the device does not have its
  /// points.
  bool IsLastRefusal(std::size_t query) const;
  /// Call it when a probe was answered: the device is present, so later silence to a query counts.
  void OnProbed() { heard_ = true; }
  /// Returns the points that are set apart because the device did not answer them. The caller
  /// reports their quality together with the reply to `query`. Only one query returns them, so that
  /// they are reported about once per poll cycle: the query with the lowest index that was answered
  /// since the last change. For other queries the result is empty.
  std::span<const std::size_t> SilentlyRefused(std::size_t query);
  /// Call it when no reply came. Some devices refuse by silence, but an absent device is silent as
  /// well. So silence counts as a refusal only if other queries or probes are answered, the query
  /// has got no reply since OnReconnect, not even a refusal, and this is its third silence.
  PlanChange OnSilent(std::size_t query, Instant now);

  /// Removes the refusals, so that refused points are read with their own group again. Points of
  /// config::Group::again stay in that group, because they are retried sooner there. Returns false
  /// if there was no refusal.
  bool ForgetRefusals();
  /// Call it if another device may be connected: refused points are asked again, and split blocks
  /// are joined. A block that was split because the device was silent, and was never answered as a
  /// whole, stays split, because silence costs time.
  void OnReconnect();

 private:
  // No query reads across a cut. `first` is an index into keys_, `second` the first position behind
  // the cut.
  using Cut = std::pair<std::size_t, std::size_t>;

  static constexpr int kSilencesOfARefusal = 3;
  static constexpr Duration kLasting = 1h;  // a refusal that has lasted this long may be permanent

  /// One position to read. A large gateway has 100,000 items, so the members are narrow and ordered
  /// by size.
  struct Item {
    std::uint32_t point = 0;
    std::uint32_t key = 0;
    std::uint32_t begin = 0;
    std::uint32_t end = 1;
    // Number of the refusal (see refusals_) that set the item apart from its group; 0: not set
    // apart.
    std::uint32_t refusal = 0;
    // Value of row_, the number of runs of refusals, when the item was set apart.
    std::uint32_t row = 0;
    // How many requests in a row that begin with this item got no reply; counted while `heard` is
    // false.
    int silences = 0;
    int refusals = 0;
    config::Group group = config::Group::fast;
    // True: the device has answered "busy" or the like, see OnHeard.
    bool waits = false;
    bool silent = false;  // true: the item was set apart because the device was silent
    // True: a request for the item got a reply since OnReconnect, perhaps a refusal.
    bool heard = false;
    bool proven = false;  // true: the device has returned a value of the item at least once
    // True: a query that begins before this item and contains it was answered.
    bool crossed = false;
    bool lasting = false;  // true: the device has refused the item for kLasting or longer
    std::optional<Instant> refused_since{};
  };
  struct CutMade {
    // True: the cut was made because the device did not answer the whole block.
    bool silent = false;
    // Value of answers_ when the cut was made. If it equals answers_, nothing was answered since
    // then.
    std::size_t answers = 0;
  };

  Block<Key> BlockOf(const Item& item) const { return {keys_[item.key], item.begin, item.end, 1}; }
  /// True if it is not clear whether the device lacks the item: it has refused the item less often
  /// than Rules::refusals, or has answered "busy". The item is asked sooner than its group, so that
  /// this becomes clear soon. False if its group is polled often enough.
  bool IsInDoubt(const Item& item) const {
    const bool refused = item.waits || (item.refusals > 0 && item.refusals < rules_.refusals);
    return refused && (item.refusal != 0 || !rules_.is_often(item.group));
  }
  bool IsAskedAgain(const Item& item) const {
    const bool refused = item.refusal != 0 || IsInDoubt(item);
    return refused && item.proven && !item.silent && !item.lasting;
  }
  config::Group GroupOf(const Item& item) const {
    if (IsAskedAgain(item)) return config::Group::again;
    if (item.refusal == 0) {
      return IsInDoubt(item) && IsSeldom(item.group) ? config::Group::slow : item.group;
    }
    if (IsInDoubt(item)) return config::Group::slow;
    const bool daily = rules_.refused == WhenRefused::ask_daily && !item.proven &&
                       item.refusals >= rules_.refusals;
    if (daily) return config::Group::daily;
    return IsSeldom(item.group) ? item.group : config::Group::slow;
  }
  /// Returns a number that must be equal for items that share a request. Items of group `again` get
  /// the number of their run of refusals: a run ends when the device answers a query.
  std::size_t RefusalOf(const Item& item) const {
    return IsAskedAgain(item) ? item.row : item.refusal;
  }
  bool Joins(const Item& first, const Block<Key>& block, const Item& next) const;
  /// Cuts the query at its widest gap, or else in its middle, so that after the next Make no query
  /// reads across the cut. `silent`: the device did not answer the whole query. Returns false if
  /// the query cannot be cut.
  bool Split(std::size_t query, bool silent);
  /// Removes the cuts for which `may_go` returns true, so that the next Make joins the blocks.
  /// Returns false if no cut was removed.
  template <typename MayGo>
  bool Mend(MayGo may_go);
  bool RefusesAll(Instant now);
  PlanChange SetApart(std::size_t query);
  PlanChange Regroup(std::size_t query);
  static void NoteRefusal(Item& item, Instant now) {
    item.silences = 0;
    item.heard = true;
    item.refused_since = item.refused_since.value_or(now);
    item.lasting = now - *item.refused_since >= kLasting;
  }
  static void ClearRefusal(Item& item) {
    item.refusal = 0;
    item.refusals = 0;
    item.waits = item.silent = item.lasting = false;
    item.refused_since.reset();
  }
  /// Calls `change` for every item in the positions that the query reads, also for items of other
  /// groups.
  template <typename Change>
  void ForItemsOf(std::size_t query, Change change);
  Cut PlaceOf(std::size_t item) const { return {items_[item].key, items_[item].begin}; }
  auto FirstFrom(const Cut& place) const {
    return std::ranges::lower_bound(by_place_, place, {},
                                    [this](std::size_t i) { return PlaceOf(i); });
  }
  bool IsCrossed(const Cut& place) const;
  void ListSilent();

  Rules rules_;
  std::vector<Key> keys_;
  std::vector<Item> items_;
  std::vector<Query> queries_;
  std::vector<Block<Key>> blocks_;
  std::vector<std::vector<std::uint32_t>> members_;
  std::vector<std::uint32_t> by_place_;  // indices into items_, sorted by key and begin
  std::vector<std::size_t> silent_;  // points that are set apart for silence, see SilentlyRefused
  std::size_t teller_ = 0;  // SilentlyRefused returns silent_ only for query indices up to this one
  std::map<Cut, CutMade> cuts_;
  std::size_t answers_ = 0;
  std::uint32_t refusals_ = 0;
  std::size_t refusals_in_row_ = 0;  // refusals of proven queries since the last answer
  std::uint32_t row_ = 0;            // number of runs of refusals; an answered query ends a run
  // When split blocks are read as a whole again. While the device refuses everything: when smaller
  // requests are tried again.
  TryAgain whole_;
  bool mended_ = false;  // true: blocks were joined again and have not been answered yet
  bool heard_ = false;   // true: the device has replied since OnReconnect
};

template <typename Key>
void QueryPlan<Key>::Add(config::Group group, std::size_t point, const Key& key, std::size_t begin,
                         std::size_t end) {
  const auto known = std::ranges::find(keys_, key);
  const auto number = static_cast<std::size_t>(known - keys_.begin());
  if (known == keys_.end()) keys_.push_back(key);
  Item item;
  item.point = static_cast<std::uint32_t>(point);
  item.group = group;
  item.key = static_cast<std::uint32_t>(number);
  item.begin = static_cast<std::uint32_t>(begin);
  item.end = static_cast<std::uint32_t>(end);
  items_.push_back(item);
}

template <typename Key>
void QueryPlan<Key>::Make() {
  queries_.clear();
  blocks_.clear();
  members_.clear();
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < items_.size(); ++i) {
    const bool dropped =
        items_[i].refusal != 0 && rules_.refused == WhenRefused::drop && !items_[i].proven;
    if (!dropped) order.push_back(i);
  }
  std::ranges::sort(order, {}, [this](std::uint32_t i) {
    const Item& item = items_[i];
    return std::tuple(IsAskedAgain(item), -static_cast<int>(GroupOf(item)), item.key,
                      RefusalOf(item), item.begin, item.end, i);
  });
  for (const std::uint32_t i : order) {
    const Item& next = items_[i];
    if (queries_.empty() || !Joins(items_[members_.back().front()], blocks_.back(), next)) {
      queries_.push_back({GroupOf(next), {}});
      blocks_.push_back(BlockOf(next));
      members_.emplace_back();
    }
    Block<Key>& block = blocks_.back();
    if (next.end > block.end) {
      block.end = next.end;
      ++block.items;
    }
    queries_.back().points.push_back(next.point);
    members_.back().push_back(i);
  }
  if (by_place_.size() < items_.size()) {
    items_.shrink_to_fit();
    by_place_.resize(items_.size());
    std::iota(by_place_.begin(), by_place_.end(), 0U);
    std::ranges::sort(by_place_, {}, [this](std::size_t i) { return PlaceOf(i); });
  }
  ListSilent();
}

template <typename Key>
bool QueryPlan<Key>::Joins(const Item& first, const Block<Key>& block, const Item& next) const {
  const bool alike = GroupOf(first) == GroupOf(next) && first.key == next.key &&
                     RefusalOf(first) == RefusalOf(next);
  if (!alike) return false;
  const Block<Key> place = BlockOf(next);
  if (block.Covers(place)) return true;
  const auto cut = cuts_.lower_bound({next.key, block.begin + 1});
  const bool divided =
      cut != cuts_.end() && cut->first.first == next.key && cut->first.second <= next.begin;
  // No cut can separate points that overlap, so an overlapping `next` joins the block although it
  // lies behind a cut.
  if (divided && next.begin >= block.end) return false;
  return rules_.may_join && rules_.may_join(block, place);
}

template <typename Key>
bool QueryPlan<Key>::IsProven(std::size_t query) const {
  return std::ranges::all_of(members_[query], [this](std::size_t i) { return items_[i].proven; });
}

template <typename Key>
void QueryPlan<Key>::TakeProven(const QueryPlan& other) {
  for (Item& item : items_) {
    item.proven = std::ranges::any_of(other.items_, [&](const Item& before) {
      return before.point == item.point && before.proven;
    });
  }
}

template <typename Key>
template <typename Change>
void QueryPlan<Key>::ForItemsOf(std::size_t query, Change change) {
  const Block<Key> block = blocks_[query];
  if (rules_.reads_between && !rules_.reads_between(block.key)) {
    for (const std::size_t i : members_[query]) change(items_[i]);
    return;
  }
  const std::size_t key = items_[members_[query].front()].key;
  const auto end = FirstFrom({key, block.end});
  for (auto at = FirstFrom({key, block.begin}); at != end; ++at) {
    if (items_[*at].end <= block.end) change(items_[*at]);
  }
}

template <typename Key>
PlanChange QueryPlan<Key>::OnAnswered(std::size_t query, Instant now) {
  if (query >= queries_.size()) return PlanChange::nothing;
  if (std::exchange(refusals_in_row_, 0) != 0) ++row_;
  ++answers_;
  heard_ = true;
  const Block<Key> block = blocks_[query];
  bool restored = false;
  bool was_apart = false;
  ForItemsOf(query, [&](Item& item) {
    was_apart = was_apart || item.refusal != 0;
    restored = restored || item.refusal != 0 || IsInDoubt(item);
    ClearRefusal(item);
    item.silences = 0;
    item.heard = item.proven = true;
    item.crossed = item.crossed || item.begin > block.begin;
  });
  const bool is_whole = mended_ && cuts_.empty() && members_[query].size() > 1;
  if (was_apart || is_whole) whole_.Forget();
  if (is_whole) mended_ = false;
  const bool mended =
      whole_.TakeDue(now) && Mend([](const Cut&, const CutMade& made) { return !made.silent; });
  mended_ = mended_ || mended;
  if (!cuts_.empty()) whole_.OnRefused(now);
  if (!restored && !mended) return PlanChange::nothing;
  Make();
  return PlanChange::restored;
}

template <typename Key>
PlanChange QueryPlan<Key>::OnHeard(std::size_t query, Instant now) {
  if (query >= queries_.size()) return PlanChange::nothing;
  heard_ = true;
  ForItemsOf(query, [&](Item& item) {
    NoteRefusal(item, now);
    item.waits = item.proven;
  });
  return Regroup(query);
}

/// Recomputes the queries if a point of this query now belongs to another group.
template <typename Key>
PlanChange QueryPlan<Key>::Regroup(std::size_t query) {
  const auto stays = [&](std::size_t i) { return GroupOf(items_[i]) == queries_[query].group; };
  if (std::ranges::all_of(members_[query], stays)) return PlanChange::nothing;
  Make();
  return PlanChange::set_apart;
}

template <typename Key>
PlanChange QueryPlan<Key>::OnRefused(std::size_t query, Instant now, bool divisible) {
  if (query >= queries_.size()) return PlanChange::nothing;
  const bool last = IsLastRefusal(query);
  const bool proven = IsProven(query);
  heard_ = true;
  ForItemsOf(query, [&](Item& item) {
    NoteRefusal(item, now);
    item.waits = false;
    ++item.refusals;
  });
  if (proven && !last) return Regroup(query);
  if (proven && RefusesAll(now)) {
    const bool mended = Mend([this](const Cut&, const CutMade& made) {
      return made.answers == answers_ && !made.silent;
    });
    const PlanChange change = SetApart(query);
    if (!mended || change != PlanChange::nothing) return change;
    Make();
    return PlanChange::set_apart;
  }
  if (!divisible || !Split(query, false)) return SetApart(query);
  whole_.OnRefused(now);
  mended_ = false;
  // The refusals of the whole query do not count for its parts.
  ForItemsOf(query, [](Item& item) { item.refusals = 0; });
  Make();
  return PlanChange::split;
}

/// Counts a refusal. Returns true if the device seems to refuse everything: halving a block finds
/// one bad item in log2(items) refusals, and more refusals came without an answer. Smaller requests
/// do not help then, and whole_ makes attempts less and less frequent.
template <typename Key>
bool QueryPlan<Key>::RefusesAll(Instant now) {
  // More refusals than for one bad item, because a few items may be bad.
  constexpr std::size_t kMore = 3;
  if (++refusals_in_row_ < std::bit_width(items_.size()) + kMore) return false;
  const bool tries_parts = whole_.TakeDue(now);
  if (tries_parts) refusals_in_row_ = 1;
  whole_.OnRefused(now);
  return !tries_parts;
}

template <typename Key>
bool QueryPlan<Key>::IsLastRefusal(std::size_t query) const {
  return query < queries_.size() && std::ranges::all_of(members_[query], [this](std::size_t i) {
           return items_[i].refusals + 1 >= rules_.refusals;
         });
}

template <typename Key>
std::span<const std::size_t> QueryPlan<Key>::SilentlyRefused(std::size_t query) {
  if (query > teller_) return {};
  teller_ = query;
  return silent_;
}

template <typename Key>
void QueryPlan<Key>::ListSilent() {
  silent_.clear();
  teller_ = queries_.size();
  for (const Item& item : items_) {
    if (item.refusal != 0 && item.silent) silent_.push_back(item.point);
  }
}

template <typename Key>
PlanChange QueryPlan<Key>::OnSilent(std::size_t query, Instant now) {
  if (query >= queries_.size() || !heard_) return PlanChange::nothing;
  ForItemsOf(query, [&](Item& item) {
    item.lasting = item.refused_since && now - *item.refused_since >= kLasting;
  });
  Item& first = items_[members_[query].front()];
  if (first.heard || ++first.silences < kSilencesOfARefusal) return Regroup(query);
  first.silences = 0;
  if (Split(query, true)) {
    // The whole query was silent three times, so a part is set apart or split after one more
    // silence.
    ForItemsOf(query, [](Item& item) { item.silences = kSilencesOfARefusal - 1; });
    Make();
    return PlanChange::split;
  }
  ForItemsOf(query, [](Item& item) { item.silent = true; });
  const PlanChange change = SetApart(query);
  ListSilent();
  return change;
}

/// A query can be cut where an item begins and all items before it have ended.
template <typename Key>
bool QueryPlan<Key>::Split(std::size_t query, bool silent) {
  const Block<Key>& block = blocks_[query];
  std::vector<std::size_t> places;
  std::size_t widest = 0;
  std::size_t at = 0;
  std::size_t end = block.begin;
  for (const std::size_t i : members_[query]) {
    const Item& item = items_[i];
    if (item.begin >= end && item.begin > block.begin) {
      places.push_back(item.begin);
      if (item.begin - end > widest) {
        widest = item.begin - end;
        at = item.begin;
      }
    }
    end = std::max<std::size_t>(end, item.end);
  }
  if (places.empty()) return false;
  if (widest == 0) at = places[(places.size() - 1) / 2];
  cuts_[{items_[members_[query].front()].key, at}] = {.silent = silent, .answers = answers_};
  return true;
}

template <typename Key>
template <typename MayGo>
bool QueryPlan<Key>::Mend(MayGo may_go) {
  return std::erase_if(cuts_, [&](const auto& cut) { return may_go(cut.first, cut.second); }) != 0;
}

template <typename Key>
bool QueryPlan<Key>::IsCrossed(const Cut& place) const {
  for (auto at = FirstFrom(place); at != by_place_.end() && PlaceOf(*at) == place; ++at) {
    if (items_[*at].crossed) return true;
  }
  return false;
}

/// Gives the items of a refused query one refusal number, so that they are asked together and never
/// with items that the device answers.
template <typename Key>
PlanChange QueryPlan<Key>::SetApart(std::size_t query) {
  const auto is_apart = [this](std::size_t i) { return items_[i].refusal != 0; };
  if (std::ranges::all_of(members_[query], is_apart)) return Regroup(query);
  ++refusals_;
  ForItemsOf(query, [&](Item& item) {
    if (item.refusal != 0) return;
    item.refusal = refusals_;
    item.row = row_;
  });
  Make();
  return PlanChange::set_apart;
}

template <typename Key>
bool QueryPlan<Key>::ForgetRefusals() {
  bool refused = false;
  for (Item& item : items_) {
    if (IsAskedAgain(item)) continue;
    refused = item.refusal != 0 || refused;
    ClearRefusal(item);
  }
  if (refused) Make();
  return refused;
}

template <typename Key>
void QueryPlan<Key>::OnReconnect() {
  for (Item& item : items_) {
    ClearRefusal(item);
    item.silences = 0;
    item.heard = false;
  }
  heard_ = mended_ = false;
  refusals_in_row_ = 0;
  whole_.Forget();
  Mend([this](const Cut& place, const CutMade& made) { return !made.silent || IsCrossed(place); });
  Make();
}

}  // namespace baudgate::protocols
