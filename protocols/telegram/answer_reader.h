// Reads the answers of a described device: their outcome, and the values of its points. Remembers
// nothing. Listening notes which telegrams a device has sent by itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {

class AnswerReader {
 public:
  /// Where each point stands in answers; empty: it is not read.
  using Places = std::vector<std::optional<ReadPlace>>;

  /// `bound`: what every telegram of the device is filled with. `description` outlives it.
  AnswerReader(const Description& description, const Bound& bound, const config::Device& device);

  const Places& places() const { return places_; }

  /// `known`: what the answer has to repeat. `sent`: see Questions.
  Answer Read(std::size_t telegram, const Bound& known, const Bound& sent, View frame) const;
  /// See Conversation. Interpret also returns the fields that no point reads. It knows only
  /// `request`, not the telegrams sent before it, so it leaves out points whose question depends on
  /// such a telegram: "READ" after "CH2".
  Outcome Check(View request, View frame) const;
  Answer Interpret(View request, View frame) const;
  /// `bound`: what every telegram of the device is filled with.
  Answer ReadUnasked(View message, const Bound& bound) const;

 private:
  void AddReadings(std::size_t telegram, const Bound& sent, const Reply& reply,
                   Answer& answer) const;

  const Description& description_;
  const Places places_;
  const Questions questions_;  // by point
};

// Which of the telegrams that a device sends by itself have come: what is said of those that points
// read and that never came. Bounded memory.
class Listening {
 public:
  /// `description` and `bound` outlive it.
  Listening(const Description& description, const Bound& bound, const AnswerReader::Places& places);

  /// A whole message of the description.
  void OnMessage(View message);
  /// "no MDA comes: …"; empty: all have come that points read.
  std::string Missing() const;

 private:
  struct Awaited {
    std::size_t telegram = 0;
    bool came = false;
    std::string said;  ///< it came with another parameter: "speed_unit: M"
  };

  bool Take(Awaited& awaited, View message) const;

  const Description& description_;
  const Bound& bound_;
  std::vector<Awaited> awaited_;     // those that points read
  std::vector<std::string> others_;  // how other messages begin
};

}  // namespace baudgate::protocols::telegram
