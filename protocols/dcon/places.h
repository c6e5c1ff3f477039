// Plans how the points of a module are read and written. Places contains their addresses, Probing
// chooses the request for a silent module, and OutputGroup sets several outputs at once.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "protocols/common/identification.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

// Probing chooses the request (probe) that tests whether a silent DCON module answers: the module's
// name, one channel if polls read all channels together, or the cheapest poll that is known to
// work.

/// A read command and the form of its reply. Example: `#AA` with joined numbers.
struct Read {
  std::string command;
  Form form = Form::number;
  bool operator==(const Read&) const = default;
};

class Probing {
 public:
  /// Index: point; empty: the point is not read.
  using Reads = std::vector<std::optional<ReadAddress>>;

  /// `plan` must have been made before. `channels`: number of values in the reply to `#AA`. The
  /// references must stay valid for the lifetime of this object.
  Probing(const Settings& settings, const Reads& reads, const QueryPlan<Read>& plan,
          std::size_t channels);

  /// True if the next probe is `$AAM` in the other checksum mode. Every fourth unanswered probe is.
  bool IsInOtherMode() const;
  std::string Command(const Identification& identification) const;
  /// True if no poll sends `command`, so its reply cannot be a late reply to a poll.
  bool IsOwn(std::string_view command) const { return command == own_; }

  void OnAnswered(std::string_view command);
  void OnPolled();
  /// Call it after each failed probe. `own`: the result of IsOwn for its command. Returns true if
  /// another probe must be sent at once.
  bool OnFailed(bool own, bool silent);
  void OnReconnect() { choice_.OnReconnect(); }

 private:
  const Settings& settings_;
  const QueryPlan<Read>& plan_;
  std::string own_;  ///< the probe that no poll sends; empty: no such request exists
  ProbeChoice choice_;
  std::size_t unanswered_ = 0;
};

// An OutputGroup is eight digital outputs of one module, which `#AA00DD` sets together. The states
// of the outputs that do not change come from the module's digital word, which is read directly
// before the write. The points define which bit of that word shows which output. Source: dcon
// reference, 8.2.
//
//   relay_1: read "$6[b1]", write "#11{bit}"      output 1 of the low group is bit 1 of $6
//   on relay_1, off relay_3:   > $016  < !000900      before: relays 3 and 0 are on (8 | 1)
//                              > #010003              after: relays 0 and 1 are on
struct OutputGroup {
  std::string command;  ///< command that sets all outputs of the group: "#00"
  std::string read;   ///< command that reads the digital word with the states of the outputs: "$6"
  unsigned base = 0;  ///< bit of the digital word that shows the first output of the group

  bool operator==(const OutputGroup&) const = default;
};

struct GroupedOutput {
  OutputGroup group;
  unsigned number = 0;  ///< number of the output in its group, 0…7
};

/// Returns the group and number of the output that a point with these addresses writes. Empty: the
/// output belongs to no group and is written alone.
std::optional<GroupedOutput> GroupOf(const std::optional<ReadAddress>& read,
                                     const std::optional<WriteAddress>& write,
                                     const Settings& settings);

/// Index: point; empty: the point is not an output of a group.
using GroupedOutputs = std::vector<std::optional<GroupedOutput>>;

/// Returns how many of `writes`, counted from the first, set different outputs of one group.
std::size_t Together(const GroupedOutputs& outputs, std::span<const PointValue> writes);

std::uint8_t AllOutputs(const GroupedOutputs& outputs, const Task& task, std::uint64_t word);

std::uint8_t OutputsIn(const OutputGroup& group, std::uint64_t word);

/// The parsed addresses of all points. The vectors `reads`, `writes` and `outputs` are indexed by
/// point; an entry is empty if the point is not read, not written, or no output of a group.
struct Places {
  Places(const config::Device& device, const Settings& options);

  /// Returns how many values the reply to `command` must have, according to the options or else the
  /// points. 0: any number.
  std::size_t ChannelsOf(std::string_view command, const Settings& settings) const;
  std::optional<Form> FormOf(std::string_view command) const;
  /// True if a point writes a setting (not an output) with `command`.
  bool IsSetting(std::string_view command) const;

  std::span<const std::size_t> ReadBy(std::string_view command) const;

  Probing::Reads reads;
  /// The points that a command reads, by command.
  std::map<std::string, std::vector<std::size_t>, std::less<>> by_command;
  std::vector<std::optional<WriteAddress>> writes;
  /// The elements of `writes` that write settings, not outputs.
  std::vector<WriteAddress> settings;
  GroupedOutputs outputs;
};

QueryPlan<Read> MakePlan(const config::Device& device, const Places& places);

}  // namespace baudgate::protocols::dcon
