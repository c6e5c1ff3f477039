// Writes to the points of one module: the command, and what its reply means. Several outputs of a
// group go out in one command, which sets the whole group (output_group.h), so what the other
// outputs are is read just before:
//
//   on relay_1, off relay_3:   Next  $6       Take  !000900     relays 3 and 0 are on
//                              Next  #0003    Take  >           done
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "protocols/conversation.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/reply_reader.h"

namespace baudgate::protocols::dcon {

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
