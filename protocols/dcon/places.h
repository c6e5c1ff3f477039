// Where the values of a module's points stand: their addresses, parsed once, and the requests that
// read them. Probing chooses the request for a silent module, and OutputGroup sets several outputs
// at once.
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

// Which request a silent DCON module is looked for with: its name, one channel where polls read all
// together, or the cheapest poll that is known to work. Asked by conversation.h.

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

// Several digital outputs of one module in one exchange: `#AA00DD` sets all eight of a group. What
// the others are comes from the module's own digital word, read just before; points say which bit
// shows which output. Points come from the configuration, commands go to conversation.h. Source:
// dcon reference, 8.2.
//
//   relay_1: read "$6[b1]", write "#11{bit}"      output 1 of the low group is bit 1 of $6
//   on relay_1, off relay_3:   > $016  < !000900      8 | 1: relays 3 and 0 are on
//                              > #010003              all eight: 0 and 1 on
struct OutputGroup {
  std::string command;  ///< "#00": sets all of it
  std::string read;     ///< "$6": shows it
  unsigned base = 0;    ///< the bit of its first output there

  bool operator==(const OutputGroup&) const = default;
};

struct GroupedOutput {
  OutputGroup group;
  unsigned number = 0;  ///< in the group, 0…7
};

/// Empty: it is written alone.
std::optional<GroupedOutput> GroupOf(const std::optional<ReadAddress>& read,
                                     const std::optional<WriteAddress>& write,
                                     const Settings& settings);

using GroupedOutputs = std::vector<std::optional<GroupedOutput>>;  ///< by point

/// How many of these, from the first on, are different outputs of one group.
std::size_t Together(const GroupedOutputs& outputs, std::span<const PointValue> writes);

/// All outputs of the group, as they are in `word` but for those that the task writes.
std::uint8_t AllOutputs(const GroupedOutputs& outputs, const Task& task, std::uint64_t word);

/// As they are.
std::uint8_t OutputsIn(const OutputGroup& group, std::uint64_t word);

/// Each list is by point; nothing where a point is not read or not written.
struct Places {
  Places(const config::Device& device, const Settings& options);

  /// How many values the reply to `command` has, by options and points; 0: nothing says so.
  std::size_t ChannelsOf(std::string_view command, const Settings& settings) const;
  /// The form of the reply to `command`, if a point reads it.
  std::optional<Form> FormOf(std::string_view command) const;
  /// A point is written with the command, and is no output.
  bool IsSetting(std::string_view command) const;

  /// Indices of the points that the command reads.
  std::span<const std::size_t> ReadBy(std::string_view command) const;

  Probing::Reads reads;
  std::map<std::string, std::vector<std::size_t>, std::less<>> by_command;  ///< see ReadBy
  std::vector<std::optional<WriteAddress>> writes;
  std::vector<WriteAddress> settings;  ///< those of writes that are no outputs
  GroupedOutputs outputs;
};

/// One request for each command, however many points it serves.
QueryPlan<Read> MakePlan(const config::Device& device, const Places& places);

}  // namespace baudgate::protocols::dcon
