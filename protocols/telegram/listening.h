// Which of the telegrams that a device sends by itself have come: what is said of those that points
// read and that never came. Bounded memory.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "protocols/telegram/answer_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

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
