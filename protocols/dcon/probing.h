// Which request a silent DCON module is looked for with: its name, one channel where polls read all
// together, or the cheapest poll that is known to work. Asked by conversation.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocols/common/probe_choice.h"
#include "protocols/common/query_plan.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

/// One read command and the form of its reply: `#01` as joined numbers.
struct Read {
  std::string command;
  Form form = Form::number;
  bool operator==(const Read&) const = default;
};

class Probing {
 public:
  using Reads = std::vector<std::optional<ReadAddress>>;  ///< by point; empty: it is not read

  /// `plan` has been made; both outlive it. `channels`: values of `#AA`.
  Probing(const Settings& settings, const Reads& reads, const QueryPlan<Read>& plan,
          std::size_t channels);

  /// The next one is to be sent as `$AAM` in the other checksum mode: every fourth time.
  bool IsInOtherMode() const;
  std::string Command(const Identification& identification) const;
  /// Whether its answer is one that no poll gets.
  bool IsOwn(std::string_view command) const { return command == own_; }

  /// A probe was answered, or a poll.
  void OnAnswered(std::string_view command);
  void OnPolled();
  /// A probe failed. True: another one is worth sending at once.
  bool OnFailed(bool own, bool silent);
  void OnReconnect() { choice_.OnReconnect(); }

 private:
  const Settings& settings_;
  const QueryPlan<Read>& plan_;
  std::string own_;  ///< empty: there is none
  ProbeChoice choice_;
  std::size_t unanswered_ = 0;
};

}  // namespace baudgate::protocols::dcon
