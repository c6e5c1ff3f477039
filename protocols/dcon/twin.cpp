// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/twin.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/values.h"

namespace baudgate::protocols::dcon {
namespace {

std::uint64_t Unsigned(const Value& value, std::uint64_t most) {
  if (const auto* exact = std::get_if<std::uint64_t>(&value)) return std::min(*exact, most);
  const double number = ToDouble(value);
  if (!(number > 0)) return 0;
  if (number >= static_cast<double>(most)) return most;
  return static_cast<std::uint64_t>(std::llround(number));
}

std::string Hex(std::uint64_t value, std::size_t digits) {
  std::string text;
  for (std::size_t i = digits; i-- > 0;) {
    text += HexByte(static_cast<std::uint8_t>((value >> (4 * i)) & 15U))[1];
  }
  return text;
}

std::string Decimal(std::uint64_t value, std::size_t digits) {
  std::string text = std::to_string(value);
  if (text.size() < digits) text.insert(0, digits - text.size(), '0');
  return text;
}

bool IsDigital(Form form) { return form == Form::bits || form == Form::status; }

std::uint64_t Place(const ReadAddress& read, const Value& value) {
  using Kind = ReadAddress::Select;
  switch (read.select) {
    case Kind::bit:
      return ToDouble(value) >= 0.5 ? 1ULL << read.index : 0;
    case Kind::bits:
      return Unsigned(value, (1ULL << read.count) - 1) << read.index;
    case Kind::high:
      return Unsigned(value, 0xFF) << 8U;
    case Kind::low:
      return Unsigned(value, 0xFF);
    default:
      return Unsigned(value, 0xFFFF'FFFF);
  }
}

std::uint8_t TypeFor(std::string_view unit) {
  if (unit == "mV") return 0x0C;
  if (unit == "mA") return 0x0D;
  return unit == "degC" || unit == "°C" ? 0x0F : 0x08;
}

}  // namespace

DconTwin::DconTwin(const config::Device& device, TwinValues& values)
    : settings_(ReadSettings(device.options)),
      address_(ParseAddress(device.address).value()),
      who_(HexByte(address_)),
      points_(
          device, values, [](const config::Point& point) { return ParseRead(point.read); },
          [](const config::Point& point) { return ParseWrite(point.write); }) {
  for (const Known& known : points_.all()) {
    const auto input = known.read ? InputOf(*known.read) : std::nullopt;
    if (input) types_[*input] = TypeFor(known.point->unit);
  }
}

void DconTwin::ReplyAs(std::string_view address) { who_ = HexByte(ParseAddress(address).value()); }

Bytes DconTwin::Answer(View request, Instant now) {
  const auto command = ParseRequest(request, settings_.checksum);
  if (!command) return {};
  if (watchdog_ > Duration::zero() && now - host_heard_at_ > watchdog_) tripped_ = true;
  if (command->broadcast) {
    if (command->text == "#") TakeSample(now);
    if (command->text == "~") host_heard_at_ = now;
    return {};
  }
  if (command->address != address_) return {};
  std::optional<std::string> reply = AnswerWatchdog(command->text, now);
  if (!reply) reply = AnswerSample(command->text);
  if (!reply) reply = AnswerRead(command->text, now);
  if (!reply) reply = AnswerChannel(command->text, now);
  if (!reply) reply = AnswerIdentity(command->text);
  if (!reply && command->text == "$5" && Counts()) {
    reply = "!" + who_ + (std::exchange(restarted_, false) ? "1" : "0");
  }
  if (!reply && settings_.channel_types) reply = AnswerChannelType(command->text);
  if (!reply) reply = AnswerWrite(command->text);
  if (!reply) return {};
  const bool front = settings_.checksum && settings_.counter_checksum == ChecksumPlace::front;
  if (front && reply->size() == 9 && command->text.size() == 2 && command->text.front() == '#') {
    return BuildCounterReplyFront(reply->substr(1));
  }
  if (settings_.data_address && reply->starts_with('>')) reply->insert(1, who_);
  return BuildReply(*reply, settings_.checksum);
}

const DconTwin::Known* DconTwin::Find(std::string_view command) const {
  return points_.Find([&](const ReadAddress& read) { return read.command == command; });
}

const DconTwin::Known* DconTwin::FindChannel(std::string_view command, std::size_t channel) const {
  return points_.Find(
      [&](const ReadAddress& read) { return read.command == command && read.index == channel; });
}

std::size_t DconTwin::Channels(const std::string& command) const {
  if (settings_.channels != 0) return settings_.channels;
  std::size_t count = 0;
  for (const Known& known : points_.all()) {
    if (!known.read || known.read->command != command) continue;
    count = std::max<std::size_t>(count, known.read->index + 1);
  }
  return count;
}

std::string DconTwin::Joined(Form form, const std::string& command, Instant now) const {
  std::string text = ">";
  const bool hex = form == Form::words;
  for (std::size_t channel = 0; channel < Channels(command); ++channel) {
    const bool enabled = channel >= 32 || ((settings_.enabled >> channel) & 1U) != 0;
    if (!enabled && settings_.disabled == Disabled::missing) continue;
    Value value = 0.0;
    if (const Known* known = FindChannel(command, channel)) value = points_.Get(*known, now);
    if (!enabled) value = 0.0;
    std::string field = FormatField(value, settings_, hex);
    if (!enabled && settings_.disabled == Disabled::blank) field.assign(field.size(), ' ');
    text += field;
  }
  return text;
}

/// Returns the digital word for `command`, with the values of all its points. The points of all
/// digital commands are parts of one word; only those of `$L` have a word of their own.
std::uint64_t DconTwin::Word(const std::string& command, Form form, Instant now) const {
  std::uint64_t word = 0;
  for (const Known& known : points_.all()) {
    if (!known.read) continue;
    const ReadAddress& read = *known.read;
    const bool same = read.command == command ||
                      (IsDigital(form) && IsDigital(read.form) && !read.command.starts_with("$L"));
    if (same) word |= Place(read, points_.Get(known, now));
  }
  return IsDigital(form) ? DigitalWire(word, settings_) : word;
}

/// Returns `told`, the text of a reply to `$AA2`, with the data format and checksum bit that the
/// options define. Example: "080600" with a checksum is "080640".
std::string DconTwin::Configuration(std::string told) const {
  if (told.size() != 6) return told;
  const unsigned checksum = settings_.checksum ? 0x40 : 0;
  const unsigned others = ParseInteger<unsigned>(told.substr(4), 16).value_or(0) & ~0x43U;
  const auto format =
      static_cast<std::uint8_t>(static_cast<unsigned>(settings_.format) | checksum | others);
  return told.replace(4, 2, HexByte(format));
}

/// Returns the reply to `$AA2` without its address, such as "080600". If a point reads the whole
/// text, its value is used; points that read bits of the format byte set these bits.
std::string DconTwin::ConfiguredText(Instant now) const {
  std::string text = (settings_.types.empty() ? "40" : settings_.types[0]) + "0600";
  unsigned bits = 0;
  for (const Known& known : points_.all()) {
    if (!known.read || known.read->command != "$2") continue;
    const Value value = points_.Get(known, now);
    if (known.read->select == ReadAddress::Select::whole) {
      text = ToText(value);
    } else if (ToDouble(value) >= 0.5) {
      bits |= 1U << known.read->index;
    }
  }
  return bits == 0 || text.size() != 6
             ? text
             : text.substr(0, 4) + HexByte(static_cast<std::uint8_t>(bits));
}

std::optional<std::string> DconTwin::AnswerRead(const std::string& command, Instant now) const {
  const Known* known = Find(command);
  if (known == nullptr) {
    const bool digital =
        points_.Find([](const ReadAddress& read) { return IsDigital(read.form); }) != nullptr;
    if (!digital || (command != "@" && command != "$6")) return std::nullopt;
  }
  const Form form =
      known != nullptr ? known->read->form : DefaultForm(command).value_or(Form::bits);
  const auto value = [&] { return points_.Get(*known, now); };
  switch (form) {
    case Form::numbers:
    case Form::words:
      return Joined(form, command, now);
    case Form::number:
      return ">" + FormatField(value(), settings_, false);
    case Form::readback:
      return "!" + who_ + FormatField(value(), settings_, false);
    case Form::bits:
      return ">" + Hex(Word(command, form, now), 4);
    case Form::status:
      return "!" + Hex(Word(command, form, now), 4) + "00";
    case Form::counter:
      return ">" + Hex(Unsigned(value(), 0xFFFF'FFFF), 8);
    case Form::decimal:
      return command.starts_with('$') ? "!" + who_ + Decimal(Unsigned(value(), 9999), 4)
                                      : "!" + who_ + Decimal(Unsigned(value(), 65535), 5);
    case Form::hex:
      return "!" + who_ + Hex(Word(command, form, now), HexDigits(command).second);
    case Form::text:
      if (command != "$2") return "!" + who_ + ToText(value());
      return "!" + who_ + Configuration(ConfiguredText(now));
  }
  return std::nullopt;
}

/// Answers `#AAN` if the profile polls `#AA`. If the channel does not exist or is disabled, an OWEN
/// module (option identify is false) is silent, and other modules send a refusal.
std::optional<std::string> DconTwin::AnswerChannel(const std::string& command, Instant now) const {
  const Known* joined = Find("#");
  if (joined == nullptr || command.size() != 2 || command.front() != '#') return std::nullopt;
  const auto channel = HexDigit(command[1]);
  const bool enabled = channel && ((settings_.enabled >> *channel) & 1U) != 0;
  if (!enabled || *channel >= Channels("#")) {
    return settings_.identify ? std::optional("?" + who_) : std::nullopt;
  }
  Value value = 0.0;
  if (const Known* known = FindChannel("#", *channel)) value = points_.Get(*known, now);
  return ">" + FormatField(value, settings_, false);
}

std::optional<std::string> DconTwin::AnswerIdentity(const std::string& command) const {
  if (!settings_.identify) return std::nullopt;
  if (command == "$M") return "!" + who_ + "TWIN";
  if (command == "$F") return "!" + who_ + "A1.0";
  if (command == "$6" && Find("#") != nullptr) return "!" + who_ + Hex(settings_.enabled & 0xFF, 2);
  if (command == "$2") {
    return "!" + who_ + Configuration(ConfiguredText({}));
  }
  return std::nullopt;
}

/// Answers `$AA8Ci` (reads the type of an input) and `$AA7CiRrr` (sets it).
std::optional<std::string> DconTwin::AnswerChannelType(const std::string& command) {
  const bool sets = command.size() == 7 && command.starts_with("$7C") && command[4] == 'R';
  const auto input = InputOfQuestion(sets ? "$8" + command.substr(2, 2) : command);
  if (!input) return std::nullopt;
  const auto known = types_.find(*input);
  if (known == types_.end()) return "?" + who_;
  if (!sets) return "!" + who_ + command.substr(2) + "R" + HexByte(known->second);
  const auto type = ParseInteger<std::uint8_t>(std::string_view(command).substr(5), 16);
  if (!type) return "?" + who_;
  known->second = *type;
  return "!" + who_;
}

bool DconTwin::Counts() const {
  return points_.Find([](const ReadAddress& read) { return read.total; }) != nullptr;
}

/// Carries out `$60` and `$C0`: they set the counter that `#0` reads to zero.
void DconTwin::Clear(const std::string& command) {
  if (command.size() != 3) return;
  const bool counter = command.starts_with("$6") || command.starts_with("$C");
  for (const Known& known : points_.all()) {
    if (counter && known.read && known.read->command == "#" + command.substr(2)) {
      points_.Set(known, std::uint64_t{0});
    }
  }
}

std::optional<std::string> DconTwin::AnswerWrite(const std::string& command) {
  for (const Known& known : points_.all()) {
    const auto value = known.write ? ParseWritten(*known.write, command) : std::nullopt;
    if (!value) continue;
    if (tripped_ && !known.write->setting) return "!";
    if (!HasValue(*value)) return "?" + who_;
    if (known.write->kind == WriteAddress::Kind::action) {
      Clear(command);
      return "!" + who_;
    }
    points_.Set(known, *value);
    return known.write->setting ? "!" + who_ : ">";
  }
  return AnswerGroup(command);
}

/// Carries out `#AA00DD` if points write single outputs of the group. Empty: there is no such
/// point.
std::optional<std::string> DconTwin::AnswerGroup(const std::string& command) {
  if (command.size() != 5 || !command.starts_with("#0")) return std::nullopt;
  const auto bits = ParseInteger<unsigned>(std::string_view(command).substr(3), 16);
  std::optional<std::string> reply;
  for (const Known& known : points_.all()) {
    const auto output = GroupOf(known.read, known.write, settings_);
    if (!bits || !output || output->group.command != command.substr(0, 3)) continue;
    if (tripped_) return "!";
    points_.Set(known, (*bits >> output->number & 1U) != 0);
    reply = ">";
  }
  return reply;
}

/// Answers `~AA3EVV` (sets the host watchdog), `~AA0` (its status) and `~AA1` (clears it).
std::optional<std::string> DconTwin::AnswerWatchdog(const std::string& command, Instant now) {
  const bool writes = points_.FindWritable([](const WriteAddress&) { return true; }) != nullptr;
  if (!writes) return std::nullopt;
  if (command == "~0" && tripped_) return "!" + who_ + "04";
  if (command == "~1") {
    tripped_ = false;
    host_heard_at_ = now;
    return "!" + who_;
  }
  if (command.size() != 5 || !command.starts_with("~3")) return std::nullopt;
  const auto tenths = ParseInteger<unsigned>(std::string_view(command).substr(3), 16);
  if (!tenths) return std::nullopt;
  watchdog_ = command[2] == '1' ? *tenths * Duration(100ms) : Duration();
  host_heard_at_ = now;
  AnswerWrite(command);
  return "!" + who_;
}

/// Stores the sample that `$AA4` will return.
void DconTwin::TakeSample(Instant now) {
  const Known* known = Find(kAskSample);
  if (known == nullptr) return;
  const Form form = known->read->form;
  sample_ = form == Form::number ? FormatField(points_.Get(*known, now), settings_, false)
                                 : Hex(Word(kAskSample, form, now), 4) + "00";
  fetched_ = false;
}

std::optional<std::string> DconTwin::AnswerSample(const std::string& command) {
  const Known* known = Find(kAskSample);
  if (command != kAskSample || known == nullptr) return std::nullopt;
  if (sample_.empty()) return "?" + who_;
  const std::string first = std::exchange(fetched_, true) ? "0" : "1";
  return (known->read->form == Form::number ? ">" + who_ : std::string("!")) + first + sample_;
}

}  // namespace baudgate::protocols::dcon
