// `Description` contains the telegrams of a device, compiled from YAML (compile.h): the bytes that
// are sent, the possible answers, and their meaning. It is made when the configuration is read, and
// never changes. OptionTable describes the options of a device.
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

/// An example of a telegram in a description. It is checked when the description is read. The
/// simulated device takes the values of fields that no point reads from it.
struct Example {
  Bytes send{};
  Bytes receive{};
  Bound sent{};
  Bound values{};
};

struct Telegram {
  std::string name;
  config::Mark mark;
  /// The bytes that are sent; empty: the device sends the telegram unasked.
  std::optional<Form> send{};
  std::vector<Form> receive{};  ///< the possible answers; empty: there is no answer
  std::vector<Form> refused{};  ///< answers with which the device refuses the request
  std::map<std::string, Codes, std::less<>> codes{};
  bool reads = false;   ///< true: the telegram changes nothing in the device
  bool repeat = false;  ///< true: the telegram is allowed to be repeated although `reads` is false
  bool listen = false;
  /// True: the telegram is sent before others, but only the first time; after a failure it is sent
  /// once more.
  bool once = false;
  /// True: a field without a valid number means that the answer is damaged, so the telegram is
  /// repeated.
  bool strict = false;
  /// Indices of the telegrams that are sent before this telegram, and (`behind`) after it.
  std::vector<std::size_t> before{};
  std::vector<std::size_t> behind{};
  Duration pause{};        ///< silence on the line before the telegram is sent
  Duration wait{};         ///< maximum time until the answer; zero: the device's reply time
  Duration idle{};         ///< silence that ends an answer which has no other end
  std::string identity{};  ///< name of the field that contains the name of the device
  std::vector<Example> examples{};

  /// Returns the field {value}, which gets the value of a written point. Null: the telegram has no
  /// such field.
  const Element* value_field() const { return send ? send->pattern.Find(kValue) : nullptr; }
  bool may_repeat() const { return reads || repeat; }
  /// Returns the example whose sent values agree best with `sent`; if none agrees, the first
  /// example.
  const Example& ExampleFor(const Bound& sent) const;
  const Element* FindField(std::string_view field) const;
};

class Description final : public config::Description {
 public:
  explicit Description(std::string text) : config::Description(std::move(text)) {}

  std::vector<Telegram> telegrams;
  std::size_t most = 256;

  std::optional<std::size_t> Find(std::string_view name) const;
  bool listens() const;

  struct Sent {
    std::size_t telegram = 0;
    Match match;
    Bound values;
  };
  /// Returns the telegram that has these bytes. If several fit, it is the telegram with the most
  /// fixed bytes. Empty: no telegram fits.
  std::optional<Sent> Recognise(View request) const;
};

/// Returns the description in the options. Null: the device has no description, or it could not be
/// read.
std::shared_ptr<const Description> DescriptionOf(const config::Options& options);

struct Settings {
  /// Null: the device has no description, see DescriptionOf.
  std::shared_ptr<const Description> description{};
  Bound parameters{};  ///< values for fields of telegrams, the password among them
};
Settings ReadSettings(const config::Options& options);

/// Returns the values for the fields that every telegram can have: address, password, parameters.
Bound BoundOf(const Settings& settings, std::string_view address);
/// Returns the address as a number if it is a number, else as a text.
Value AddressValue(std::string_view address);

inline constexpr std::string_view kTelegramsOption = "telegrams";
inline constexpr std::string_view kParametersOption = "parameters";

std::span<const OptionSpec> OptionTable();

/// Checks an address and returns its usual form: a number, hex with 0x, or a word of letters,
/// digits, '-', '_' and '.'.
Result<std::string> CanonicalAddress(std::string_view address);

}  // namespace baudgate::protocols::telegram
