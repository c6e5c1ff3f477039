// What each input of a module measures, where each has a type code of its own (`$AA8Ci` →
// `!AACiRrr`: ADAM-4015, 4017+, 4018+, 4019+). Asked with identification.h, judges single points.
// Source: dcon reference, 5, 7.3 and 19.11.
//
//   > $018C2   < !01C2R0D      input 2 measures mA: a point of it in V is not good
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

/// The input that a command with joined or single numbers reads: 2 of "#[2]" and of "#2". Nothing:
/// it reads none, or one whose type cannot be asked.
std::optional<unsigned> InputOf(const ReadAddress& read);

/// "$8C2", or its input.
std::string_view QuestionOfInput(unsigned input);
std::optional<unsigned> InputOfQuestion(std::string_view command);

/// Whether a module of this type measures what the point says: a current in mA, a frequency in Hz,
/// pulses for a total. True where that cannot be told.
bool Measures(std::uint8_t type, const ReadAddress& read, std::string_view unit,
              const Settings& settings);

class ChannelTypes {
 public:
  /// Both outlive it.
  ChannelTypes(const config::Device& device, const Settings& settings);

  /// The input whose type has to be asked before `command` goes out: all that it reads and whose
  /// unit can be judged.
  std::optional<unsigned> Next(std::string_view command) const;
  /// One that is to be asked again, in turn: all of them within a slow period, evenly spread.
  std::optional<unsigned> NextAnew(std::string_view command, Instant now);
  void OnAnswer(unsigned input, const DecodedReply& reply);
  /// Silence, or what answers something else. Twice: the module does not tell it.
  void OnNothing(unsigned input);
  /// Another module may answer now. What was known holds until all is asked again.
  void Forget();

  /// What a number of the point is multiplied with to be one in its unit. Empty: its input
  /// measures something else.
  std::optional<double> FactorOf(std::size_t point) const;
  /// All points that are not good for it, of inputs in `enabled`. Empty: none.
  std::string Remark(std::uint32_t enabled) const;

 private:
  struct Input {
    unsigned number = 0;
    bool asked = false;
    int silences = 0;
    std::optional<std::uint8_t> type;
  };

  static bool Reads(std::string_view command, const Input& input);
  Input* Find(unsigned input);
  bool AllAsked() const;
  void Settle(Input& input, std::optional<std::uint8_t> type);
  std::optional<std::uint8_t> TypeOf(std::size_t point) const;

  const config::Device& device_;
  std::vector<std::optional<unsigned>> inputs_of_points_;  // by point; empty: not judged
  std::vector<Input> inputs_;                              // in the order of the points
  Duration period_;
  std::size_t turn_ = 0;         // of inputs_: the next one to be asked again
  std::optional<Instant> next_;  // and when; empty: an even share of the period from now on
};

}  // namespace baudgate::protocols::dcon
