// `Description` holds the telegrams of a device, compiled from YAML (compile.h): what is sent, what
// may come back, and what the answers mean. It is made when the configuration is read, and never
// changes. OptionTable describes the options of a device.
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

/// An example in a description. It is checked when the description is read, and the twin fills its
/// fields that no point reads with the values of the example.
struct Example {
  Bytes send{};
  Bytes receive{};
  Bound sent{};    ///< fields of `send`
  Bound values{};  ///< fields of `receive`
};

struct Telegram {
  std::string name;
  config::Mark mark;
  std::optional<Form> send{};   ///< empty: the device sends the telegram unasked
  std::vector<Form> receive{};  ///< empty: nothing comes back
  std::vector<Form> refused{};  ///< answers that refuse the request
  std::map<std::string, Codes, std::less<>> codes{};  ///< by field
  bool reads = false;   ///< the telegram changes nothing in the device
  bool repeat = false;  ///< the telegram may be repeated although `reads` is false
  bool listen = false;
  bool once = false;  ///< a telegram that goes before is sent once, until a failure
  /// A field without a valid number is damage, and the answer is asked for again.
  bool strict = false;
  std::vector<std::size_t> before{};  ///< numbers of telegrams
  std::vector<std::size_t> behind{};
  Duration pause{};        ///< silence on the line before the telegram
  Duration wait{};         ///< the longest time until the answer; zero: the device's reply time
  Duration idle{};         ///< silence that ends an answer without another end
  std::string identity{};  ///< the field with the name of the device
  std::vector<Example> examples{};

  /// Returns the field for the value of a written point; null: there is none.
  const Element* value_field() const { return send ? send->pattern.Find(kValue) : nullptr; }
  bool may_repeat() const { return reads || repeat; }
  /// Returns the example whose sent values agree best with `sent`; else the first example.
  const Example& ExampleFor(const Bound& sent) const;
  /// Returns null if no answer has this field.
  const Element* FindField(std::string_view field) const;
};

class Description final : public config::Description {
 public:
  explicit Description(std::string text) : config::Description(std::move(text)) {}

  std::vector<Telegram> telegrams;
  std::size_t most = 256;  ///< most bytes of a telegram

  /// Empty: no telegram has this name.
  std::optional<std::size_t> Find(std::string_view name) const;
  bool listens() const;

  struct Sent {
    std::size_t telegram = 0;
    Match match;
    Bound values;
  };
  /// Returns the telegram that these bytes are, with the most fixed bytes if several fit; empty:
  /// none.
  std::optional<Sent> Recognise(View request) const;
};

/// Returns null if the device has no description, or it could not be read.
std::shared_ptr<const Description> DescriptionOf(const config::Options& options);

/// The options of a device.
struct Settings {
  std::shared_ptr<const Description> description{};  ///< null: as for DescriptionOf
  Bound parameters{};  ///< values of fields; the password is one of them
};
Settings ReadSettings(const config::Options& options);

/// Returns the values for the fields of every telegram: address, password, parameters.
Bound BoundOf(const Settings& settings, std::string_view address);
/// Returns a number if the address is one.
Value AddressValue(std::string_view address);

// The options of a device: its description, and values for the fields of its telegrams.

inline constexpr std::string_view kTelegramsOption = "telegrams";
inline constexpr std::string_view kParametersOption = "parameters";

std::span<const OptionSpec> OptionTable();

/// Checks an address: a number, hex with 0x, or a word of letters, digits, '-', '_' and '.'.
Result<std::string> CanonicalAddress(std::string_view address);

}  // namespace baudgate::protocols::telegram
