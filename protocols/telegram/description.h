// The telegrams of a device, compiled from its description (compile.h): what is sent, what may come
// back, and what that means. Made once when the configuration is read, and never changed.
// OptionTable has the options of a device.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/options.h"
#include "config/model/problem.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/matching.h"

namespace baudgate::protocols::telegram {

/// What a description says is true of one telegram: it is checked when the description is read, and
/// the twin of the device fills with it what no point reads.
struct Example {
  Bytes send{};
  Bytes receive{};
  Bound sent{};    ///< of the fields of `send`
  Bound values{};  ///< of the fields of `receive`
};

struct Telegram {
  std::string name;
  config::Mark mark;
  std::optional<Form> send{};                         ///< empty: the device sends it unasked
  std::vector<Form> receive{};                        ///< empty: nothing comes back
  std::vector<Form> refused{};                        ///< answers that say no
  std::map<std::string, Codes, std::less<>> codes{};  ///< by field
  bool reads = false;                                 ///< changes nothing in the device
  bool repeat = false;                                ///< may be sent twice anyway
  bool listen = false;
  bool once = false;    ///< of one that goes before: only until something fails
  bool strict = false;  ///< what is no number is damage, and the answer is asked for again
  std::vector<std::size_t> before{};  ///< numbers of telegrams
  std::vector<std::size_t> behind{};
  Duration pause{};        ///< silence on the line before it
  Duration wait{};         ///< so long the device may think; zero: its reply time
  Duration idle{};         ///< silence that ends an answer which nothing else ends
  std::string identity{};  ///< the field with the name of the device
  std::vector<Example> examples{};

  /// Where the value of a point that is written stands; null: nowhere.
  const Element* value_field() const { return send ? send->pattern.Find(kValue) : nullptr; }
  bool may_repeat() const { return reads || repeat; }
  /// For these values of what is sent; else the first.
  const Example& ExampleFor(const Bound& sent) const;
  /// Null: no answer has such a field.
  const Element* FindField(std::string_view field) const;
};

class Description final : public config::Description {
 public:
  explicit Description(std::string text) : config::Description(std::move(text)) {}

  std::vector<Telegram> telegrams;
  std::size_t most = 256;  ///< bytes of the longest telegram

  /// Empty: there is none of this name.
  std::optional<std::size_t> Find(std::string_view name) const;
  bool listens() const;

  struct Sent {
    std::size_t telegram = 0;
    Match match;
    Bound values;
  };
  /// Which telegram these bytes are; empty: none. Of several the one with most fixed bytes.
  std::optional<Sent> Recognise(View request) const;
};

/// Null: the device has none, or it could not be read.
std::shared_ptr<const Description> DescriptionOf(const config::Options& options);

/// The options of a device.
struct Settings {
  std::shared_ptr<const Description> description{};  ///< null: as DescriptionOf
  Bound parameters{};                                ///< the password is one of them
};
Settings ReadSettings(const config::Options& options);

/// What every telegram of the device may be filled with: address, password, parameters.
Bound BoundOf(const Settings& settings, std::string_view address);
/// A number where it is one.
Value AddressValue(std::string_view address);

// The options of a device: its description, and what fills the fields of its telegrams.

inline constexpr std::string_view kTelegramsOption = "telegrams";
inline constexpr std::string_view kParametersOption = "parameters";

std::span<const OptionSpec> OptionTable();

/// A number, hex with 0x, or a word of letters, digits, '-', '_' and '.'.
Result<std::string> CanonicalAddress(std::string_view address);

}  // namespace baudgate::protocols::telegram
