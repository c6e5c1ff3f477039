// Which module answers at the address, found out before it is polled: name, type code, data format
// and checksum mode, asked with the only two commands that no module takes for a write in either
// mode. Questions go through conversation.h to the line. Source: dcon reference, 4.1 "Hazards".
//
//   checksum: true   > $01MD2 (silence)  > $012B7 (silence)  > $01M  < !017017
//                    its checksum is off
//
// Polls of such a module would write: `@01` + `A1` is "set outputs to A1" where no checksum is due.
//
// ChannelTypes keeps what each input measures, and Questions when something is asked.
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

// Input ranges of analog modules by their type code, the first byte of what `$AA2` answers.
// Source: tables of ICP DAS I-7011/18 and I-7012/17 and Advantech ADAM-4000. The codes 30 to 35
// mean something else on output modules, 40 and above are no analog inputs.

/// What a number of a module of this type is multiplied with to be one in `unit`: 0.001 for mV
/// where V is wanted. Empty: such a module cannot measure that. A unit that no type has ("bar")
/// is the user's own, and takes the number as it is.
std::optional<double> FactorOfType(std::uint8_t type, std::string_view unit);

/// Whether it is the type of an analog output. 30, 31 and 33 are thermistors of ADAM-4015, which
/// takes no samples.
bool IsAnalogOutput(std::uint8_t type);

// What each input of a module measures, where each has a type code of its own (`$AA8Ci` →
// `!AACiRrr`: ADAM-4015, 4017+, 4018+, 4019+). Asked with Identification, judges single points.
// Source: dcon reference, 5, 7.3 and 19.11.
//
//   > $018C2   < !01C2R0D      input 2 measures mA: a point of it in V is not good

/// The input that a command with joined or single numbers reads: 2 of "#[2]" and of "#2". Nothing:
/// it reads none, or one whose type cannot be asked.
std::optional<unsigned> InputOf(const ReadAddress& read);

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

inline constexpr const char* kAskName = "$M";
inline constexpr const char* kAskType = "$2";
inline constexpr const char* kAskMask = "$6";

class Identification {
 public:
  /// Both outlive it.
  Identification(const config::Device& device, const Settings& settings);

  struct Question {
    std::string_view command;
    bool other_mode = false;  ///< with a checksum where the configuration has none, or without one

    bool operator==(const Question&) const = default;
  };

  /// What to ask before `command` (without address) may go out; empty: no question is left.
  std::optional<Question> Next(std::string_view command);
  /// What it is time to ask again behind `command`.
  std::optional<Question> NextAnew(std::string_view command, Instant now);
  /// No question of the round is left.
  bool is_done() const { return done_; }
  /// Whether the command may go out now: only after the round of questions, and if nothing wrong
  /// was found. If the module did not answer them: harmless commands always, others only with
  /// `checksum: false`, because a module whose checksum is on ignores them. The exception,
  /// IsTakenCutShort, is for the caller to check.
  bool Allows(std::string_view command) const;
  /// Whether a module whose checksum is on would take the last two characters of this request for
  /// the checksum, and it is not known that the module's is off. Example: `#01+03.070` ends
  /// with the right checksum of `#01+03.0`, which sets another value.
  bool IsTakenCutShort(View request) const;
  /// The module was silent to a whole round, so that writes are not sent. If something harmless is
  /// read, that shows its mode.
  bool IsMute() const;
  /// Whether the module would take the command for a read in whichever mode it is.
  static bool IsHarmless(std::string_view command);

  /// `reply` answers the question, whatever it says.
  void OnAnswer(const Question& question, const DecodedReply& reply);
  /// Nothing came that answers it. `strange`: but something did, which may answer another request;
  /// so the module speaks in this mode.
  void OnNothing(const Question& question, bool strange);
  /// A poll was not answered, with all its repetitions: another module may answer the next.
  void OnLost();
  /// The module has answered in the configured mode.
  void OnPolled();
  /// Another module may answer now. What is wrong stays wrong until it is known to be right.
  void OnReconnect();
  /// Another count of channels came than should.
  void AskMaskAgain() { asked_mask_ = false; }

  const DeviceTrouble& trouble() const { return trouble_; }
  /// What the number of an input point is multiplied with to be one in its unit. Empty: the
  /// point's channel measures something else.
  std::optional<double> FactorOf(std::size_t point) const;
  /// The channels that are enabled in the module, bit 0 = channel 0; empty: it has not said.
  std::optional<std::uint32_t> mask() const { return mask_; }

 private:
  void Begin();
  void Advance(const Question& question);
  DeviceTrouble Judge(std::string_view configuration);
  void Sum();
  bool WantsMask() const;

  const config::Device& device_;
  const Settings& settings_;
  bool joined_ = false;      ///< `#` is polled: which channel a number is of follows from its place
  bool only_others_ = true;  ///< nothing that its points read with is harmless
  bool sure_ = false;        ///< of the checksum mode

  // The round of questions: under way, or done since OnReconnect.
  bool done_ = false;
  bool answered_ = false;
  int step_ = 0;
  bool asked_mask_ = false;

  std::optional<std::uint8_t> type_;
  std::optional<std::uint32_t> mask_;
  DeviceTrouble mode_;  ///< what the checksum mode has shown
  DeviceTrouble kind_;  ///< what type and format byte have
  DeviceTrouble name_;
  ChannelTypes channels_;
  DeviceTrouble trouble_;  ///< the worst of these, or what is remarkable
};

// When the questions of a module's identification are asked: before the first command of a task,
// and again behind its read. A task has few exchanges, so the questions of a round may take several
// tasks.
//
//   Before("#")   $M   then $2   then nothing: "#" may go out
//   AfterRead     $2   it is time to ask again whether it is still the same module
//
class Questions {
 public:
  using Question = Identification::Question;

  /// It outlives this.
  explicit Questions(Identification& identification) : identification_(identification) {}

  /// The request under way asks this; empty: it is the task's own.
  const std::optional<Question>& asked() const { return asked_; }
  void SetAsked(std::optional<Question> question) { asked_ = question; }
  /// The same, and it is answered or has failed.
  std::optional<Question> TakeAsked();

  /// What has to be asked before `command`; empty: it may go out.
  std::optional<Question> Before(std::string_view command);
  /// What is to be asked after the read of the task under way; empty: the task is over.
  const std::optional<Question>& anew() const { return anew_; }
  /// The task has failed. True: it was behind its read.
  bool ForgetAnew();
  /// The next round of questions begins with a fresh count.
  void ForgetCount() { count_ = 0; }

  /// How a task goes on behind its read.
  Then AfterRead(std::string_view command, Instant now);
  /// How a task that wants to send `command` goes on behind a question.
  Then AfterQuestion(std::string_view command);
  void OnReconnect();

 private:
  Identification& identification_;
  std::optional<Question> asked_;
  std::optional<Question> anew_;
  int count_ = 0;  ///< in the task under way
};

}  // namespace baudgate::protocols::dcon
