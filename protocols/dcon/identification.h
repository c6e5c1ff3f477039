// Identification finds out which module answers at the address before it is polled: name, type
// code, data format and checksum mode. It uses the only two commands that no module takes for a
// write in either checksum mode. Source: dcon reference, 4.1 "Hazards".
//
//   checksum: true   > $01MD2 (silence)  > $012B7 (silence)  > $01M  < !017017
//                    its checksum is off
//
// A poll of such a module would write: `@01` + `A1` means "set outputs to A1" if the module's
// checksum is off.
//
// ChannelTypes stores what each input measures. Questions decides when a question is asked.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/conversation.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

// Input ranges of analog modules by type code, the first byte in the reply to `$AA2`. Source:
// tables of ICP DAS I-7011/18 and I-7012/17 and Advantech ADAM-4000. The codes 30 to 35 have
// another meaning on output modules; 40 and above are no analog inputs.

/// Returns the factor that converts a number of a module of this type to `unit`. Example: 0.001 if
/// the module measures mV and `unit` is V. Empty: such a module cannot measure `unit`. A unit that
/// no type has ("bar") is the user's own; the factor is then 1.
std::optional<double> FactorOfType(std::uint8_t type, std::string_view unit);

/// True for the type codes of analog outputs. ADAM-4015 uses 30, 31 and 33 for thermistor inputs,
/// but the result matters only for modules that take samples (`#**`), and ADAM-4015 takes none.
bool IsAnalogOutput(std::uint8_t type);

// ChannelTypes stores what each input measures, for modules with a type code for each input
// (`$AA8Ci` → `!AACiRrr`: ADAM-4015, 4017+, 4018+, 4019+). It judges single points.
// Source: dcon reference, 5, 7.3 and 19.11.
//
//   > $018C2   < !01C2R0D      input 2 measures mA: a point in V that reads it has a bad quality

/// Returns 2 for "#[2]" and "#2". Nothing: the address reads no input whose type can be asked.
std::optional<unsigned> InputOf(const ReadAddress& read);

/// Returns 2 for "$8C2". Nothing: `command` does not ask for the type of an input.
std::optional<unsigned> InputOfQuestion(std::string_view command);

/// True if a module of this type can measure what the point reads: a current in mA, a frequency in
/// Hz, pulses for a total. Also true if that cannot be decided.
bool Measures(std::uint8_t type, const ReadAddress& read, std::string_view unit,
              const Settings& settings);

class ChannelTypes {
 public:
  /// The references must outlive this object.
  ChannelTypes(const config::Device& device, const Settings& settings);

  /// Returns an input whose type must be asked before `command` is sent: one that `command` reads
  /// for a point whose unit can be judged. Empty: all are asked.
  std::optional<unsigned> Next(std::string_view command) const;
  /// Returns an input whose type is due again. Each is due once per slow period, evenly spread.
  std::optional<unsigned> NextAnew(std::string_view command, Instant now);
  void OnAnswer(unsigned input, const DecodedReply& reply);
  /// Call if no reply or a strange one came. After the second time no types are asked.
  void OnNothing(unsigned input);
  /// Call if another module may be connected. Known types stay valid until they are asked again.
  void Forget();

  /// Returns the factor from the input's unit to the point's. Empty: another quantity is measured.
  std::optional<double> FactorOf(std::size_t point) const;
  /// Describes all points whose unit does not fit their input, for the inputs in the mask
  /// `enabled`.
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
  std::vector<std::optional<unsigned>> inputs_of_points_;  // index: point; empty: not judged
  std::vector<Input> inputs_;                              // in the order of the points
  Duration period_;
  std::size_t turn_ = 0;         // index in inputs_ of the next input to ask again
  std::optional<Instant> next_;  // when to ask it; empty: not scheduled yet
};

inline constexpr const char* kAskName = "$M";
inline constexpr const char* kAskType = "$2";
inline constexpr const char* kAskMask = "$6";

class Identification {
 public:
  /// The references must outlive this object.
  Identification(const config::Device& device, const Settings& settings);

  struct Question {
    std::string_view command;
    bool other_mode = false;  ///< send in the checksum mode that is not configured

    bool operator==(const Question&) const = default;
  };

  /// Returns the question to ask before `command` (without address). Empty: none is left.
  std::optional<Question> Next(std::string_view command);
  /// Returns a question that is due again and is asked after `command`. Empty: none is due.
  std::optional<Question> NextAnew(std::string_view command, Instant now);
  bool is_done() const { return done_; }
  /// True if the command may be sent now: the round of questions is complete without trouble. If
  /// the module answered none of them, harmless commands are allowed, and others only with
  /// `checksum: false`, because a module with its checksum on ignores them. The caller must also
  /// check IsTakenCutShort.
  bool Allows(std::string_view command) const;
  /// True if the module's checksum might be on and the last two characters of this request are a
  /// correct checksum of the rest. Example: a module would take `#01+03.070` for `#01+03.0`, which
  /// sets another value.
  bool IsTakenCutShort(View request) const;
  /// True if the module did not answer a whole round, so writes are not sent. False if a point is
  /// read with a harmless command, because its reply shows the checksum mode.
  bool IsMute() const;
  /// True if a module takes the command for a read in either checksum mode.
  static bool IsHarmless(std::string_view command);

  /// Call with any reply to the question, also a refusal.
  void OnAnswer(const Question& question, const DecodedReply& reply);
  /// Call if no reply answers the question. `strange`: a frame came, but it may answer another
  /// request. It proves that the module uses the checksum mode of the question.
  void OnNothing(const Question& question, bool strange);
  /// Call if a poll and all its retries got no reply: another module may answer the next poll.
  void OnLost();
  /// Call if the module has answered in the configured checksum mode.
  void OnPolled();
  /// Call if another module may be connected. A trouble stays until a reply disproves it.
  void OnReconnect();
  /// Call if a reply had an unexpected number of channels: the enabled channels are asked again.
  void AskMaskAgain() { asked_mask_ = false; }

  const DeviceTrouble& trouble() const { return trouble_; }
  /// Returns the factor to the point's unit. Empty: its channel measures another quantity.
  std::optional<double> FactorOf(std::size_t point) const;
  /// Returns the channels that are enabled in the module (bit 0: channel 0). Empty: unknown.
  std::optional<std::uint32_t> mask() const { return mask_; }

 private:
  void Begin();
  void Advance(const Question& question);
  DeviceTrouble Judge(std::string_view configuration);
  void Sum();
  bool WantsMask() const;

  const config::Device& device_;
  const Settings& settings_;
  bool joined_ = false;      ///< `#` is polled: a number's position defines its channel
  bool only_others_ = true;  ///< no point is read with a harmless command (IsHarmless)
  bool sure_ = false;        ///< the module has answered in the configured checksum mode

  // State of the round of questions, since its begin.
  bool done_ = false;
  bool answered_ = false;
  int step_ = 0;
  bool asked_mask_ = false;

  std::optional<std::uint8_t> type_;
  std::optional<std::uint32_t> mask_;
  DeviceTrouble mode_;  ///< wrong checksum mode
  DeviceTrouble kind_;  ///< wrong type or format byte
  DeviceTrouble name_;
  ChannelTypes channels_;
  DeviceTrouble trouble_;  ///< the most serious of these troubles, or remarks
};

// Questions decides when the questions of Identification are asked: before the first command of a
// task, and again after its read. The number of exchanges of a task is limited, so a round may take
// several tasks.
//
//   Before("#")   $M   then $2   then nothing: "#" may be sent
//   AfterRead     $8C2           the type of input 2 is due again
class Questions {
 public:
  using Question = Identification::Question;

  /// `identification` must outlive this object.
  explicit Questions(Identification& identification) : identification_(identification) {}

  /// The question in the request under way. Empty: the request is the task's own.
  const std::optional<Question>& asked() const { return asked_; }
  void SetAsked(std::optional<Question> question) { asked_ = question; }
  /// Returns asked() and clears it. Call when the request was answered or has failed.
  std::optional<Question> TakeAsked();

  /// Returns the question to ask before `command`. Empty: `command` may be sent.
  std::optional<Question> Before(std::string_view command);
  /// The question to ask after the read of the task under way. Empty: none.
  const std::optional<Question>& anew() const { return anew_; }
  /// Call if the task has failed. Returns true if its read had succeeded and anew() was asked.
  bool ForgetAnew();
  void ForgetCount() { count_ = 0; }

  /// Call after the read of a task. Returns how the task continues.
  Then AfterRead(std::string_view command, Instant now);
  /// Call after a question of a task that will send `command`. Returns how the task continues.
  Then AfterQuestion(std::string_view command);
  void OnReconnect();

 private:
  Identification& identification_;
  std::optional<Question> asked_;
  std::optional<Question> anew_;
  int count_ = 0;  ///< questions in the task under way
};

}  // namespace baudgate::protocols::dcon
