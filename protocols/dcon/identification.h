// Identification finds out which module answers at the address before it is polled: its name, type
// code, data format and checksum mode. It uses the only two commands (`$AAM`, `$AA2`) that no
// module takes for a write in either checksum mode. Source: dcon reference, 4.1 "Hazards".
//
//   checksum: true   > $01MD2 (silence)  > $012B7 (silence)  > $01M  < !017017
//                    the module answers only without a checksum: its checksum is off
//
// A poll with a checksum could write to a module whose checksum is off: it takes `@01` + `A1`
// (checksum) for "set outputs to A1".
//
// ChannelTypes stores what each input measures. Questions decides when a question is asked.
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

// FactorOfType and IsAnalogOutput judge the type code of a module, the first byte in the reply to
// `$AA2`, which defines the input range. Source: tables of ICP DAS I-7011/18 and I-7012/17 and
// Advantech ADAM-4000. The codes 30 to 35 have another meaning on output modules; the codes 40 and
// above are not analog inputs.

/// Returns the factor that converts a number of a module of this type to `unit`. Example: 0.001 if
/// the module measures mV and `unit` is V. Empty: such a module cannot measure `unit`. If no module
/// type has the unit ("bar"), the user has chosen it, and the factor is 1.
std::optional<double> FactorOfType(std::uint8_t type, std::string_view unit);

/// True for the type codes of analog outputs. ADAM-4015 uses 30, 31 and 33 for thermistor inputs,
/// but the result matters only for modules that take samples (`#**`), and ADAM-4015 takes none.
bool IsAnalogOutput(std::uint8_t type);

// ChannelTypes stores what each input measures, for modules with a type code for each input
// (`$AA8Ci` → `!AACiRrr`: ADAM-4015, 4017+, 4018+, 4019+). A wrong type spoils only the points of
// this input. Source: dcon reference, 5, 7.3 and 19.11.
//
//   > $018C2   < !01C2R0D      input 2 measures mA: a point in V that reads it has a bad quality

/// Returns the number of the input that the point reads: 2 for "#[2]" and "#2". Empty: the address
/// reads no input whose type can be asked.
std::optional<unsigned> InputOf(const ReadAddress& read);

/// Returns the number of the input whose type `command` asks for: 2 for "$8C2". Empty: `command`
/// does not ask for the type of an input.
std::optional<unsigned> InputOfQuestion(std::string_view command);

/// True if a module of this type can measure what the point reads: a current in mA, a frequency in
/// Hz, pulses for a total. Also true if the type code tells nothing about the point.
bool Measures(std::uint8_t type, const ReadAddress& read, std::string_view unit,
              const Settings& settings);

class ChannelTypes {
 public:
  ChannelTypes(const config::Device& device, const Settings& settings);

  /// Returns an input whose type must be asked before `command` is sent, because `command` reads it
  /// for a point in V, mV, mA or °C. Empty: the types of all these inputs were asked.
  std::optional<unsigned> Next(std::string_view command) const;
  /// Returns an input whose type must be asked again after `command`. Each input is asked once in
  /// the period of slow points (Device::slow), evenly spread. Empty: no type is due.
  std::optional<unsigned> NextAnew(std::string_view command, Instant now);
  void OnAnswer(unsigned input, const DecodedReply& reply);
  /// Call it if the question for the type of this input got no reply or an odd reply. A known type
  /// stays valid. An input whose type is unknown counts as one without a type after two such
  /// failures.
  void OnNothing(unsigned input);
  /// Call it if another module may be connected. Known types stay valid until they are asked again.
  void Forget();

  /// Returns the factor from the input's unit to the point's unit; 1 if the type of the input is
  /// unknown, or Identity::ignore is set. Empty: the input measures another quantity.
  std::optional<double> FactorOf(std::size_t point) const;
  /// Lists the points whose unit does not fit their input, for the inputs in the mask `enabled`.
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
  // Index: point; empty: the point's unit is not judged.
  std::vector<std::optional<unsigned>> inputs_of_points_;
  std::vector<Input> inputs_;  // in the order of the points that read them
  Duration period_;
  std::size_t turn_ = 0;         // index in inputs_ of the next input to ask again
  std::optional<Instant> next_;  // when to ask inputs_[turn_] again; empty: not scheduled yet
};

inline constexpr const char* kAskName = "$M";
inline constexpr const char* kAskType = "$2";
inline constexpr const char* kAskMask = "$6";

class Identification {
 public:
  Identification(const config::Device& device, const Settings& settings);

  struct Question {
    std::string_view command;
    /// True: the question is sent in the opposite of the configured checksum mode.
    bool other_mode = false;

    bool operator==(const Question&) const = default;
  };

  /// Returns the question to ask before `command` (without its address). Empty: no question is
  /// left.
  std::optional<Question> Next(std::string_view command);
  /// Returns a question that is due again and must be asked after `command`. Empty: no question is
  /// due.
  std::optional<Question> NextAnew(std::string_view command, Instant now);
  bool is_done() const { return done_; }
  /// True if the command is allowed to be sent now: all questions were asked, and there is no
  /// trouble. With `checksum: true`, only harmless commands are allowed before the module has
  /// answered in this mode. With `checksum: false` all commands are allowed, because a module whose
  /// checksum is on ignores them (exception: IsTakenCutShort). Always true if the option identify
  /// is false.
  bool Allows(std::string_view command) const;
  /// True if the module's checksum might be on and the last two characters of this request are by
  /// chance a correct checksum of the rest, so that the module would take them for it. Example: a
  /// module would take `#01+03.070` for `#01+03.0`, which sets another value.
  bool IsTakenCutShort(View request) const;
  /// True if writes are not sent: the option checksum is true, the module has answered no question
  /// in either mode, and no point is read with a harmless command, whose reply would show the mode.
  bool IsMute() const;
  /// True if a module takes the command for a read in either checksum mode.
  static bool IsHarmless(std::string_view command);

  /// Call it with any reply to the question, also with a refusal.
  void OnAnswer(const Question& question, const DecodedReply& reply);
  /// Call it if no reply answers the question. `strange`: a frame came, but it may answer another
  /// request; it proves that the module uses the checksum mode of the question.
  void OnNothing(const Question& question, bool strange);
  /// Call it if a poll and all its retries got no reply: another module may answer the next poll.
  void OnLost();
  /// Call it if the module has answered in the configured checksum mode.
  void OnPolled();
  /// Call it if another module may be connected. A trouble stays until a reply shows that it is
  /// over.
  void OnReconnect();
  /// Call it if a reply had an unexpected number of channels: the module is then asked again which
  /// channels are enabled.
  void AskMaskAgain() { asked_mask_ = false; }

  const DeviceTrouble& trouble() const { return trouble_; }
  /// Returns the factor from the number in a reply to the point's unit; 1 if the type is unknown.
  /// Empty: the input measures another quantity (only with the option channel_types).
  std::optional<double> FactorOf(std::size_t point) const;
  /// Returns the mask of the channels that are enabled in the module (bit 0: channel 0). Empty: the
  /// mask is unknown.
  std::optional<std::uint32_t> mask() const { return mask_; }

 private:
  void Begin();
  void Advance(const Question& question);
  DeviceTrouble Judge(std::string_view configuration);
  void Sum();
  bool WantsMask() const;

  const config::Device& device_;
  const Settings& settings_;
  /// True: a point is polled with `#`, whose reply contains the numbers of all enabled channels
  /// without channel numbers. So the mask of enabled channels is asked (WantsMask).
  bool joined_ = false;
  bool only_others_ = true;  ///< true: no point is read with `#AA` or `#AAN` (IsHarmless)
  bool sure_ = false;        ///< true: the module has answered in the configured checksum mode

  // State of the questions in kRound since they were last begun.
  bool done_ = false;
  bool answered_ = false;
  int step_ = 0;
  bool asked_mask_ = false;

  std::optional<std::uint8_t> type_;
  std::optional<std::uint32_t> mask_;
  DeviceTrouble mode_;  ///< trouble: wrong checksum mode
  DeviceTrouble kind_;  ///< trouble: wrong type or format byte
  DeviceTrouble name_;
  ChannelTypes channels_;
  /// The most serious of mode_, kind_ and name_; without a trouble, its text has remarks for the
  /// status.
  DeviceTrouble trouble_;
};

// Questions decides when the questions of Identification are asked: before the first command of a
// task, and after its read if a question is due again. A task can have kMostSteps exchanges, so the
// questions may take several tasks.
//
//   Before("#")   $M   then $2   then nothing: "#" may be sent
//   AfterRead     $8C2           the type of input 2 is due again
class Questions {
 public:
  using Question = Identification::Question;

  explicit Questions(Identification& identification) : identification_(identification) {}

  /// Returns the question in the request under way. Empty: the request is the command of the task.
  const std::optional<Question>& asked() const { return asked_; }
  void SetAsked(std::optional<Question> question) { asked_ = question; }
  /// Returns asked() and clears it. Call it when the request was answered or has failed.
  std::optional<Question> TakeAsked();

  /// Returns the question to ask before `command`. Empty: no question is needed, and `command` can
  /// be sent.
  std::optional<Question> Before(std::string_view command);
  /// Returns the question to ask after the read of the task under way. Empty: no question follows.
  const std::optional<Question>& anew() const { return anew_; }
  /// Call it if the task has failed. Returns true if the read of the task had succeeded, and only
  /// the question anew() has failed.
  bool ForgetAnew();
  void ForgetCount() { count_ = 0; }

  Then AfterRead(std::string_view command, Instant now);
  /// Call it after a question. `command`: the command that the task sends after its questions.
  Then AfterQuestion(std::string_view command);
  void OnReconnect();

 private:
  Identification& identification_;
  std::optional<Question> asked_;
  std::optional<Question> anew_;
  int count_ = 0;  ///< number of questions in the task under way
};

}  // namespace baudgate::protocols::dcon
