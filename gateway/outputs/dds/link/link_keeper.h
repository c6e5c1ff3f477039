// Decides when the process that speaks DDS is started, taken for silent, given up and started
// again. Pure: what happened and the time come in; gateway/outputs/dds/link/process_link.h acts on
// it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/outputs/dds/link/link_message.h"
#include "gateway/outputs/dds/link/link_state.h"

namespace baudgate::dds {

class LinkKeeper {
 public:
  enum class Wish {
    nothing,
    start,    ///< a process, then say Started
    give_up,  ///< end the link, then say Ended
  };
  /// After this time without a sign of life `status` says so; after the second time the process is
  /// restarted.
  static constexpr Duration kSilent = 2s;
  static constexpr Duration kGivenUp = 10s;
  static constexpr Duration kOpening = 1min;
  /// A process of this age has met every subscriber that is there.
  static constexpr Duration kYoung = 15s;

  /// `starts`: we start the process (the first time at once, then 0.1, 0.5, 1, 2, 5, 10 s after
  /// each end, and from the beginning again after a minute of life); otherwise somebody else does.
  explicit LinkKeeper(bool starts) : starts_(starts) {}

  Wish Look(Instant now);
  /// When to look again, if nothing happens.
  Instant NextLook() const;

  void Started(Instant now);
  /// It said that samples may come.
  void Opened(Instant now);
  /// A sign of life.
  void Counted(const LinkCounts& counts, Instant now);
  /// `reason` goes on "it …": "it was ended by signal 6".
  void Ended(std::string reason, Instant now);

  const LinkState& state() const { return state_; }
  /// Where the next process asks for subscribers: the addresses that this process has reached, and
  /// while it is young, those that the process before it had reached.
  const std::vector<config::HostPort>& reached() const { return reached_; }
  /// How long its silence may last now.
  Duration patience() const { return state_.opened ? kGivenUp : kOpening; }

 private:
  const bool starts_;
  LinkState state_;
  bool first_ = true;
  Instant started_{};
  std::size_t rung_ = 0;  ///< of the ladder: the next wait
  LinkCounts before_;     ///< by processes that have ended
  std::vector<config::HostPort> reached_;
};

}  // namespace baudgate::dds
