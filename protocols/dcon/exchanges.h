// The requests of one module as frames: its own commands, broadcasts, and the questions of its
// identification, which go out in either checksum mode. ReplyReader reads the replies, and WriteJob
// writes points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocols/conversation.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

class Requests {
 public:
  /// `settings` outlive it.
  Requests(std::uint8_t address, const Settings& settings);

  Request Own(std::string_view command) const;
  Request Broadcast(std::string_view text) const;
  Request Question(const Identification::Question& question) const;
  /// Whether the request is a question in the other checksum mode.
  bool IsInOtherMode(View request) const;
  /// The settings with which the reply to the request is read.
  const Settings& SettingsFor(View request) const {
    return IsInOtherMode(request) ? other_mode_ : settings_;
  }

 private:
  const std::uint8_t address_;
  const Settings& settings_;
  Settings other_mode_;  ///< the same with the checksum the other way
};

// What replies of one module mean for its points. It remembers nothing.
//
//   > #01   < >+05.880+01.230     point "#[0]" is 5.88, point "#[1]" is 1.23

/// A request and its reply, decoded.
struct Exchanged {
  Command command;
  DecodedReply reply;
};

class ReplyReader {
 public:
  /// `counts`: totals are kept of counters. All others outlive it.
  ReplyReader(const Settings& settings, const Requests& requests, const Places& places,
              const Identification& identification, bool counts)
      : settings_(settings),
        requests_(requests),
        places_(places),
        identification_(identification),
        counts_(counts) {}

  /// Empty: the request is none.
  std::optional<Exchanged> Read(View request, View frame) const;
  /// A reading of each point that the command reads.
  Answer ReadingsOf(const Exchanged& exchanged) const;
  /// See Conversation::Interpret. `polled`: the device has points.
  Answer Interpret(View request, View frame, bool polled) const;

 private:
  /// The frame ends with a right checksum, but this request went out without one: it is a late
  /// reply to an earlier request in the configured mode.
  bool IsOfOwnMode(View request, View frame) const;
  std::optional<Form> PlannedForm(std::string_view command) const;
  void AddLabels(const Exchanged& exchanged, Answer& answer) const;

  const Settings& settings_;
  const Requests& requests_;
  const Places& places_;
  const Identification& identification_;
  const bool counts_;
};

// Writes to the points of one module: the command, and what its reply means. Several outputs of a
// group go out in one command, which sets the whole group (places.h), so what the other
// outputs are is read just before:
//
//   on relay_1, off relay_3:   Next  $6       Take  !000900     relays 3 and 0 are on
//                              Next  #0003    Take  >           done
//
class WriteJob {
 public:
  /// Both outlive it.
  WriteJob(const config::Device& device, const Places& places);

  /// How many of these writes, from the first on, go together.
  std::size_t Together(std::span<const PointValue> writes) const;

  struct Step {
    std::string command;
    bool prepares = false;  ///< it reads what the others are
  };
  Result<Step> Next(const Task& task, Instant now);
  /// `answer`: the readings of the reply to the command of Next.
  Answer Take(const Task& task, const Exchanged& exchanged, Answer answer, Instant now);
  /// The command of Next was not answered. `prepares`: as in Step.
  void OnFailure(const Task& task, bool prepares, bool silent);

  /// A poll or a read for a write has brought a digital word.
  void OnWord(const std::string& command, std::uint64_t word) { words_[command] = word; }
  /// Something else was asked in between.
  void OnOther() { certain_.reset(); }
  /// Another module may answer now.
  void OnReconnect();

 private:
  struct Certain {
    std::uint64_t word = 0;
    Instant at{};
  };

  Step NextOfGroup(const Task& task, Instant now);
  Answer TakeOutputs(const Task& task, const Exchanged& exchanged, Answer answer, Instant now);

  const config::Device& device_;
  const Places& places_;
  std::map<std::string, std::uint64_t> words_;  ///< by command, as they were read last
  std::optional<Certain> certain_;  ///< what outputs are, for the write of several under way
  bool alone_ = false;              ///< the module does not take several outputs at once
};

}  // namespace baudgate::protocols::dcon
