// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/decode.h"

#include <algorithm>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/dcon/conversation.h"

namespace baudgate::protocols::dcon {
namespace {

DecodedReply Fail(Outcome outcome, std::string reason) {
  DecodedReply decoded;
  decoded.outcome = outcome;
  decoded.reason = std::move(reason);
  return decoded;
}

DecodedReply One(Form form, Value value) {
  DecodedReply decoded;
  decoded.form = form;
  decoded.fields.push_back({{std::move(value)}, 0, {}});
  return decoded;
}

std::string Shown(View frame) { return "'" + Printable(frame) + "'"; }

/// True for the commands of analog outputs, `#AA(data)`, `#AAN(data)` and `#AACn(data)`: their data
/// is a number with a decimal point.
bool IsAnalogOutput(std::string_view command) {
  return command.starts_with('#') && command.find('.') != std::string_view::npos;
}

/// Decodes the refusal "?01" or "?". Even if an analog output refuses a value beyond its range, it
/// moves to the limit (dcon reference, 10.1).
DecodedReply DecodeRefusal(const Command& request, const Reply& reply, bool read) {
  const std::string who = HexByte(request.address);
  if (!reply.body.empty() && reply.body != who) {
    return Fail(Outcome::unexpected,
                "the refusal '?" + reply.body + "' is from another module than " + who);
  }
  if (read) {
    DecodedReply decoded =
        Fail(Outcome::unsupported,
             "the module answers '?" + reply.body + "' to " + request.text +
                 ": the module does not have this command or channel, or the channel is disabled");
    decoded.remedy = "check that the profile and its channels fit the module";
    return decoded;
  }
  const std::string says = "the module answers '?" + reply.body + "' to " + request.text + ": ";
  if (!IsAnalogOutput(request.text)) {
    return Fail(Outcome::refused,
                says + "the module does not have this command, or the value is not valid for it");
  }
  DecodedReply decoded =
      Fail(Outcome::refused, says +
                                 "the value is beyond its range, and the output may have gone "
                                 "to its limit; correct the range in the point's write");
  decoded.may_have_acted = true;
  return decoded;
}

DecodedReply DecodeWrite(const Command& request, const Reply& reply, const Settings& settings,
                         View frame) {
  const DecodedReply done;
  const std::string who = HexByte(ReplyAddress(request));
  if (reply.lead == '!' && reply.body.empty()) {
    DecodedReply decoded = Fail(
        Outcome::refused,
        "the module ignored the write ('!'): its host watchdog has tripped and holds the outputs "
        "at their safe values; reset the watchdog with the command ~AA1, then write again");
    decoded.ignored = true;
    return decoded;
  }
  if (reply.lead == '>' && (reply.body.empty() || (settings.data_address && reply.body == who))) {
    return done;
  }
  // The ADAM-4024 manual does not print the reply to #AACn, so `!AA` is accepted too.
  const bool output = request.text.front() == '#' || request.text.front() == '@';
  const bool lenient = settings.write_ack_address || request.text.starts_with("#C") || !output;
  if (reply.lead == '!' && lenient && reply.body.starts_with(who)) return done;
  return Fail(Outcome::unexpected, "reply " + Shown(frame) + " is not the confirmation of a write");
}

/// Guesses the form of a reply from its characters, for a command that no point reads.
Form GuessForm(const Command& request, const Reply& reply, const Settings& settings) {
  const Form fallback = DefaultForm(request.text).value_or(Form::text);
  const std::string_view body = reply.body;
  if (request.text == "$6") {
    if (body.find_first_of("+-.") != std::string_view::npos) return Form::readback;
    return body.size() == 4 ? Form::hex : Form::status;
  }
  if (fallback != Form::number || request.text == "$3") return fallback;
  if (reply.lead == '!') return body.size() == 7 ? Form::decimal : Form::counter;
  return body.size() == 8 && IsHexText(body) && settings.format != Format::hex ? Form::counter
                                                                               : Form::number;
}

std::optional<std::string_view> Payload(const Reply& reply, std::uint8_t address, bool addressed) {
  const std::string_view body = reply.body;
  if (!addressed) return body;
  if (body.size() < 2 || ParseInteger<unsigned>(body.substr(0, 2), 16) != unsigned{address}) {
    return std::nullopt;
  }
  return body.substr(2);
}

DecodedReply DecodeNumbers(std::string_view payload, Form form, std::size_t channels,
                           const Settings& settings) {
  Fields cut = CutFields(payload, settings, form == Form::words);
  const bool joined = form == Form::numbers || form == Form::words;
  if (cut.outcome == Outcome::ok && cut.fields.empty()) {
    return Fail(Outcome::unexpected, "the reply holds no number");
  }
  if (joined) {
    AssignChannels(cut, settings, channels);
  } else if (cut.outcome == Outcome::ok && cut.fields.size() != 1) {
    return Fail(Outcome::unexpected,
                std::to_string(cut.fields.size()) + " numbers came instead of one");
  }
  DecodedReply decoded;
  decoded.form = form;
  decoded.outcome = cut.outcome;
  decoded.reason = std::move(cut.reason);
  decoded.remedy = std::move(cut.remedy);
  decoded.fields = std::move(cut.fields);
  decoded.more_enabled = cut.more_enabled;
  for (const Field& field : decoded.fields) {
    if (IsGood(field.quality) || field.quality == Quality::bad_out_of_service) continue;
    if (!decoded.reason.empty()) decoded.reason += "; ";
    decoded.reason += joined ? "channel " + std::to_string(field.channel) + " " : "";
    decoded.reason += field.note;
  }
  return decoded;
}

std::pair<std::size_t, std::size_t> DigitCount(Form form, std::string_view command) {
  if (form == Form::hex) return HexDigits(command);
  if (form == Form::decimal && command.starts_with('$')) return {4, 4};  // replies to $AAY, $AAX1
  if (form == Form::decimal) return {5, 5};
  if (form == Form::counter) return {8, 8};
  return {4, 4};
}

DecodedReply DecodeDigits(std::string_view command, std::string_view payload, Form form,
                          const Settings& settings) {
  const std::string shown = "'" + std::string(payload) + "'";
  if (form == Form::status) {
    if (payload.size() != 6 || !payload.ends_with("00")) {
      return Fail(Outcome::unexpected, "a digital status is four hex digits and 00, not " + shown);
    }
    payload.remove_suffix(2);
  }
  const auto [least, most] = DigitCount(form, command);
  if (payload.size() < least || payload.size() > most) {
    return Fail(Outcome::unexpected, std::to_string(payload.size()) + " digits came in " + shown +
                                         " instead of " + std::to_string(most) +
                                         "; check the checksum option and the module type");
  }
  const bool decimal = form == Form::decimal;
  const auto number = (decimal ? IsDecimalText(payload) : IsHexText(payload))
                          ? ParseInteger<std::uint64_t>(payload, decimal ? 10 : 16)
                          : std::nullopt;
  if (!number) return Fail(Outcome::corrupt, shown + " is not a number");
  const bool digital = form == Form::bits || form == Form::status;
  return One(form, digital ? DigitalWord(*number, settings) : *number);
}

DecodedReply DecodeText(std::string_view command, std::string_view payload) {
  if (command == "$2" && (payload.size() != 6 || !IsHexText(payload))) {
    return Fail(Outcome::unexpected,
                "a configuration is six hex digits, not '" + std::string(payload) + "'");
  }
  return One(Form::text, std::string(payload));
}

bool LeadFits(Form form, char lead) {
  switch (form) {
    case Form::numbers:
    case Form::number:
    case Form::words:
    case Form::bits:
      return lead == '>';
    case Form::counter:
      return true;
    default:
      return lead == '!';
  }
}

bool Addressed(Form form, const Reply& reply, const Settings& settings) {
  if (reply.lead == '>') return settings.data_address;
  // A manual prints the reply to `$AALS` in two forms: with an address (eight digits) and without
  // (six).
  if (form == Form::status) return reply.body.size() == 8;
  return true;
}

/// Decodes the reply to `$AA4` (fetch the sample): `>AAS(data)` of an analog module, or
/// `!S(data)00` of a digital one, which contains no address. S is 1 when the sample is fetched for
/// the first time.
DecodedReply DecodeSample(const Command& request, Form form, const Reply& reply,
                          const Settings& settings, View frame) {
  std::string_view payload = reply.body;
  const std::string who = HexByte(request.address);
  const bool own = form != Form::number || payload.starts_with(who);
  if (own && form == Form::number) payload.remove_prefix(who.size());
  if (!own || payload.empty() || (payload.front() != '0' && payload.front() != '1')) {
    return Fail(Outcome::unexpected,
                "reply " + Shown(frame) + " does not contain a sample of module " + who);
  }
  const bool first = payload.front() == '1';
  payload.remove_prefix(1);
  DecodedReply decoded = form == Form::number ? DecodeNumbers(payload, form, 1, settings)
                                              : DecodeDigits(request.text, payload, form, settings);
  decoded.first_fetch = first;
  return decoded;
}

DecodedReply DecodeRead(const Command& request, std::optional<Form> wanted, std::size_t channels,
                        const Reply& reply, const Settings& settings, View frame) {
  const Form form = wanted.value_or(GuessForm(request, reply, settings));
  if (reply.ambiguous) {
    return Fail(Outcome::unexpected,
                "the checksum fits at both ends of " + Shown(frame) +
                    "; set counter_checksum to front or end, as this module sends it");
  }
  if (!LeadFits(form, reply.lead)) {
    return Fail(Outcome::unexpected,
                "reply " + Shown(frame) + " does not have the form of a reply to " + request.text);
  }
  // A module that was started with INIT* grounded answers at address 00, but this reply begins with
  // its stored address. So the address is not compared.
  const bool init = request.text == "$2" && request.address == 0;
  const auto payload = init && reply.body.size() >= 2
                           ? std::optional(std::string_view(reply.body).substr(2))
                           : Payload(reply, request.address, Addressed(form, reply, settings));
  if (!payload) {
    DecodedReply other =
        Fail(Outcome::unexpected,
             "reply " + Shown(frame) + " is from another module than " + HexByte(request.address));
    const bool number = reply.body.starts_with('+') || reply.body.starts_with('-');
    if (settings.data_address && number) {
      other.remedy = "its replies carry no address: set data_address: false in the configuration";
    }
    return other;
  }
  if (request.text == kAskSample) return DecodeSample(request, form, reply, settings, frame);
  switch (form) {
    case Form::numbers:
    case Form::number:
    case Form::words: {
      // The cold junction temperature (`$AA3`) is a signed number in every data format.
      Settings own = settings;
      const bool signs = payload->starts_with('+') || payload->starts_with('-');
      if (request.text == "$3" && signs) own.format = Format::engineering;
      return DecodeNumbers(*payload, form, channels, own);
    }
    case Form::readback: {
      // I-7021 and ADAM-4021 send the state of their only output without a sign.
      const bool bare = !payload->empty() && HexDigit(payload->front());
      const std::string sign = bare && settings.format != Format::hex ? "+" : "";
      return DecodeNumbers(sign + std::string(*payload), form, channels, settings);
    }
    case Form::text:
      return DecodeText(request.text, *payload);
    default:
      return DecodeDigits(request.text, *payload, form, settings);
  }
}

}  // namespace

int ReplyVariant(std::string_view command, const Settings& settings) {
  if (!settings.checksum) return kNoChecksum;
  const bool counter = command.size() == 2 && command.front() == '#';
  if (!counter || settings.counter_checksum == ChecksumPlace::end) return kChecksum;
  return settings.counter_checksum == ChecksumPlace::front ? kChecksumFront : kChecksumEither;
}

std::uint8_t ReplyAddress(const Command& request) {
  if (!request.text.starts_with('%') || request.text.size() < 3) return request.address;
  const auto moved = ParseInteger<std::uint8_t>(std::string_view(request.text).substr(1, 2), 16);
  return moved.value_or(request.address);
}

DecodedReply DecodeReply(const Command& request, std::optional<Form> form, std::size_t channels,
                         View frame, const Settings& settings) {
  const auto reply = ParseReply(frame, ReplyVariant(request.text, settings));
  if (!reply) return Fail(Outcome::corrupt, "reply " + Shown(frame) + " is not a DCON frame");
  if (request.broadcast) {
    return Fail(Outcome::unexpected,
                "no device answers a broadcast, but " + Shown(frame) + " came");
  }
  const bool read = form || DefaultForm(request.text);
  if (reply->lead == '?') return DecodeRefusal(request, *reply, read);
  if (read) return DecodeRead(request, form, channels, *reply, settings, frame);
  return DecodeWrite(request, *reply, settings, frame);
}

DecodedReply DecodeConfirmation(const Command& request, View frame, const Settings& settings) {
  const auto reply = ParseReply(frame, ReplyVariant(request.text, settings));
  if (!reply) return Fail(Outcome::corrupt, "reply " + Shown(frame) + " is not a DCON frame");
  if (reply->lead == '?') return DecodeRefusal(request, *reply, false);
  if (reply->lead == '!' && reply->body == HexByte(request.address)) return {};
  return Fail(Outcome::unexpected, "reply " + Shown(frame) + " is not the confirmation of a write");
}

Field Select(const DecodedReply& decoded, const ReadAddress& address) {
  using Kind = ReadAddress::Select;
  if (address.select == Kind::index) {
    for (const Field& field : decoded.fields) {
      if (field.channel == address.index) return field;
    }
    return BadField({Quality::bad_configuration, Reason::not_fitted},
                    "the module has no such channel; correct the point");
  }
  if (decoded.fields.size() != 1)
    return BadField(Quality::bad, "the reply does not have exactly one value");
  Field field = decoded.fields.front();
  if (const auto* text = std::get_if<std::string>(&field.value)) {
    if (address.select == Kind::whole) return field;
    const auto format = ParseInteger<unsigned>(std::string_view(*text).substr(4), 16);
    if (!format) return BadField(Quality::bad, "the reply has no format byte");
    field.value = (*format >> address.index & 1U) != 0;
    return field;
  }
  const auto* word = std::get_if<std::uint64_t>(&field.value);
  if (word == nullptr || address.select == Kind::whole) return field;
  switch (address.select) {
    case Kind::bits:
      field.value = (*word >> address.index) & ((1ULL << address.count) - 1);
      break;
    case Kind::bit:
      field.value = ((*word >> address.index) & 1U) != 0;
      break;
    case Kind::high:
      field.value = (*word >> 8U) & 0xFFU;
      break;
    default:
      field.value = *word & 0xFFU;
      break;
  }
  return field;
}

namespace {

constexpr std::size_t kAnyWidth = 0;

/// True if the last two characters are a correct checksum of the rest, so they may not be digits of
/// a number.
bool EndsWithItsSum(View frame) {
  const std::string_view text = Trim(AsText(frame));
  if (text.size() < 3) return false;
  return HexByte(Sum8(frame.first(text.size() - 2))) == text.substr(text.size() - 2);
}

/// True if `command` matches `pattern`: 'n' stands for a hex digit, and '*' at the end for any
/// text.
bool FitsPrinted(std::string_view pattern, std::string_view command) {
  const bool open = pattern.ends_with('*');
  if (open) pattern.remove_suffix(1);
  if (open ? command.size() < pattern.size() : command.size() != pattern.size()) return false;
  return std::equal(pattern.begin(), pattern.end(), command.begin(),
                    [](char p, char c) { return p == 'n' ? HexDigit(c).has_value() : p == c; });
}

Reading Labelled(const Command& request, std::string_view what, Value value,
                 Quality quality = Quality::good) {
  std::string label = request.text;
  if (!what.empty()) label += " " + std::string(what);
  return {kNoPoint, std::move(value), quality, std::move(label)};
}

/// How to read the characters after `!AA` in the reply to `command`.
struct Behind {
  std::string_view command;
  enum class Kind : std::uint8_t { flag, hex, decimal, number, text } kind;
  std::size_t digits;  ///< exact number of digits, for flag, hex and decimal
  std::string_view what;
};

using Kind = Behind::Kind;
constexpr Behind kBehind[] = {
    {"$5", Kind::flag, 1, "restarted since the last read"},
    {"$6", Kind::hex, 3, "analog output in hex"},
    {"$6n", Kind::hex, 3, "analog output in hex"},
    {"$7n", Kind::flag, 1, "overflow"},
    {"$7n", Kind::number, 0, "power-on value"},
    {"$8", Kind::hex, 3, "analog output in hex"},
    {"$8n", Kind::hex, 3, "analog output in hex"},
    {"$8Cn", Kind::number, 0, "current read-back"},
    {"$9n", Kind::text, 0, "type and slew rate"},
    {"$A", Kind::hex, 1, "gate"},
    {"$Bn", Kind::hex, 1, "sensor diagnosis"},
    {"$DCn", Kind::number, 0, "start-up value"},
    {"$ECn", Kind::number, 0, "emergency stop value"},
    {"$P", Kind::text, 0, "protocol now and at the next start"},
    {"$X1", Kind::decimal, 4, "watchdog, tenths of a second"},
    {"$Y", Kind::decimal, 4, "watchdog, tenths of a second"},
    {"~4n", Kind::number, 0, "safe value"},
    {"~4", Kind::text, 0, "power-on and safe values"},
    {"~4P", Kind::text, 0, "power-on value"},
    {"~4S", Kind::text, 0, "safe value"},
    {"~D", Kind::hex, 2, "inverted inputs"},
    {"~RD", Kind::hex, 2, "response delay, ms"},
};

/// Parses one number of the configured width; its sign can be missing.
std::optional<Reading> NumberOf(const Command& request, std::string_view text,
                                std::string_view what, const Settings& settings) {
  const bool bare = !text.empty() && HexDigit(text.front());
  const Fields cut = CutFields((bare ? "+" : "") + std::string(text), settings, false);
  if (cut.outcome != Outcome::ok || cut.fields.size() != 1) return std::nullopt;
  return Labelled(request, what, cut.fields[0].value, cut.fields[0].quality);
}

std::optional<Reading> ReadBehind(const Behind& row, const Command& request, std::string_view text,
                                  const Settings& settings) {
  const bool fits = text.size() == row.digits;
  switch (row.kind) {
    case Kind::flag:
      if (text != "0" && text != "1") return std::nullopt;
      return Labelled(request, row.what, text == "1");
    case Kind::hex:
      if (!fits || !IsHexText(text)) return std::nullopt;
      return Labelled(request, row.what, *ParseInteger<std::uint64_t>(text, 16));
    case Kind::decimal:
      if (!fits || !IsDecimalText(text)) return std::nullopt;
      return Labelled(request, row.what, *ParseInteger<std::uint64_t>(text));
    case Kind::number:
      return NumberOf(request, text, row.what, settings);
    case Kind::text:
      break;
  }
  return Labelled(request, row.what, std::string(text));
}

/// Parses the reply `!01C0R08` (ADAM-4024: `!01C030`), the type code of one channel.
std::optional<Reading> ReadChannelType(const Command& request, std::string_view text) {
  if (!FitsPrinted("$8Cn", request.text) || !text.starts_with(request.text.substr(2))) {
    return std::nullopt;
  }
  text.remove_prefix(2);
  if (text.starts_with('R')) text.remove_prefix(1);
  if (text.size() != 2 || !IsHexText(text)) return std::nullopt;
  return Labelled(request, "type code", std::string(text));
}

/// Parses `!AA` (done), or `!AA` with data as the table kBehind defines it. Data of a command
/// without a row is shown as text, unless it is a read command.
std::optional<Answer> ReadAddressed(const Command& request, const Reply& reply,
                                    const Settings& settings) {
  const std::string who = HexByte(ReplyAddress(request));
  if (reply.lead != '!' || !reply.body.starts_with(who)) return std::nullopt;
  const std::string_view text = std::string_view(reply.body).substr(who.size());
  const bool read = DefaultForm(request.text).has_value();
  Answer answer;
  if (text.empty()) {
    if (read && !FitsPrinted("$6n", request.text)) return std::nullopt;
    if (request.text.front() == '#' || FitsPrinted("@*", request.text)) {
      answer.reason = "the module confirms with !" + who + " instead of >";
    }
    return answer;
  }
  auto reading = ReadChannelType(request, text);
  for (const Behind& row : kBehind) {
    if (reading) break;
    if (FitsPrinted(row.command, request.text)) reading = ReadBehind(row, request, text, settings);
  }
  if (!reading && !read) reading = Labelled(request, {}, std::string(text));
  if (!reading) return std::nullopt;
  answer.readings.push_back(std::move(*reading));
  return answer;
}

/// Parses the reply to `$AA4` (see DecodeSample) with numbers of any width.
std::optional<Answer> ReadSample(const Command& request, View frame, const Reply& reply,
                                 const Settings& settings) {
  if (request.text != "$4") return std::nullopt;
  std::string_view text = reply.body;
  const std::string who = HexByte(request.address);
  if (reply.lead == '>') {
    if (!text.starts_with(who)) return std::nullopt;
    text.remove_prefix(who.size());
  }
  if (text.empty() || (text.front() != '0' && text.front() != '1')) return std::nullopt;
  Answer answer;
  answer.readings.push_back(Labelled(request, "first fetch", text.front() == '1'));
  text.remove_prefix(1);
  if (reply.lead == '!') {
    if (text.size() != 6 || !text.ends_with("00") || !IsHexText(text)) return std::nullopt;
    const auto word = *ParseInteger<std::uint64_t>(text.substr(0, 4), 16);
    answer.readings.push_back(Labelled(request, "sample", word ^ settings.invert));
    return answer;
  }
  Settings any = settings;
  if (!EndsWithItsSum(frame)) any.width = kAnyWidth;
  const Fields cut = CutFields(text, any, IsHexText(text));
  if (cut.outcome != Outcome::ok || cut.fields.size() != 1) return std::nullopt;
  answer.readings.push_back(
      Labelled(request, "sample", cut.fields[0].value, cut.fields[0].quality));
  return answer;
}

/// Parses the decimal counter of NuDAM, `#AAND`: ten digits after `>` or `!AA`.
std::optional<Answer> ReadTenDigits(const Command& request, const Reply& reply) {
  if (!FitsPrinted("#nD", request.text)) return std::nullopt;
  std::string_view text = reply.body;
  if (text.size() == 12 && text.starts_with(HexByte(request.address))) text.remove_prefix(2);
  if (reply.lead == '?' || text.size() != 10 || !IsDecimalText(text)) return std::nullopt;
  Answer answer;
  answer.readings.push_back(Labelled(request, "counter", *ParseInteger<std::uint64_t>(text)));
  return answer;
}

/// Parses the counter of a digital input without leading zeros: `#AAN` → `!AA` and 1 to 4 digits.
std::optional<Answer> ReadShortCounter(const Command& request, View frame, const Reply& reply) {
  const std::string who = HexByte(request.address);
  if (!FitsPrinted("#n", request.text) || reply.lead != '!' || !reply.body.starts_with(who)) {
    return std::nullopt;
  }
  const std::string_view text = std::string_view(reply.body).substr(who.size());
  if (text.empty() || text.size() > 4 || !IsDecimalText(text)) return std::nullopt;
  if (EndsWithItsSum(frame)) return std::nullopt;
  Answer answer;
  answer.readings.push_back(Labelled(request, "counter", *ParseInteger<std::uint64_t>(text)));
  return answer;
}

/// Parses 15 characters of OWEN 110-224.1T: the value in the first 9, the frequency in the last 5.
std::optional<Answer> ReadFifteenCharacters(const Command& request, const Reply& reply) {
  if (request.text.front() != '#' || reply.lead != '>' || reply.body.size() != 15) {
    return std::nullopt;
  }
  const std::string_view body = reply.body;
  const auto value = ParseDecimal(Trim(body.substr(0, 9)));
  const auto frequency = ParseDecimal(Trim(body.substr(10)));
  if (!value || !frequency) return std::nullopt;
  Answer answer;
  answer.readings.push_back(Labelled(request, "value", *value));
  answer.readings.push_back(Labelled(request, "frequency", *frequency));
  return answer;
}

/// Parses the status of ND-6058: 40 bits where other modules send 16.
std::optional<Answer> ReadLongStatus(const Command& request, const Reply& reply) {
  if (request.text != "$6" || reply.lead != '!' || reply.body.size() != 10 ||
      !IsHexText(reply.body)) {
    return std::nullopt;
  }
  Answer answer;
  answer.readings.push_back(
      Labelled(request, "40 bits", *ParseInteger<std::uint64_t>(reply.body, 16)));
  return answer;
}

Answer ReadAs(const Command& request, const DecodedReply& decoded, const Settings& settings,
              const Settings& other) {
  Answer answer;
  if (other.data_address && !settings.data_address)
    answer.reason = "the reply carries the address; set data_address: true";
  if (other.width != settings.width) {
    answer.reason += answer.reason.empty() ? "" : "; ";
    answer.reason += "its numbers do not have the usual " + std::to_string(settings.width) +
                     " characters; set width: 0";
  }
  const bool joined = decoded.form == Form::numbers || decoded.form == Form::words;
  for (const Field& field : decoded.fields) {
    Reading reading = Labelled(request, {}, field.value, field.quality);
    if (joined) reading.label += "[" + std::to_string(field.channel) + "]";
    answer.readings.push_back(std::move(reading));
  }
  return answer;
}

bool MayEndWithSum(const Command& request, View frame, const Settings& settings) {
  if (EndsWithItsSum(frame)) return true;
  const std::string_view text = Trim(AsText(frame));
  if (text.size() < 3) return false;
  const Bytes shorter = ToBytes(std::string(text.substr(0, text.size() - 2)) + "\r");
  return DecodeReply(request, std::nullopt, 0, shorter, settings).outcome == Outcome::ok;
}

/// Parses replies that would be valid with other options: numbers in hex words, numbers of another
/// width, and replies with `>` that contain the address (TRP-C68).
std::optional<Answer> ReadWithOtherSettings(const Command& request, View frame, const Reply& reply,
                                            const Settings& settings) {
  if (reply.lead != '>' || !DefaultForm(request.text)) return std::nullopt;
  const bool sampled = request.text.front() == '#' || request.text.front() == '^';
  for (const bool address : {settings.data_address, true}) {
    for (const Format format : {settings.format, Format::hex}) {
      if (format == Format::hex && !sampled) continue;
      for (const std::size_t width : {settings.width, kAnyWidth}) {
        Settings other = settings;
        other.data_address = address;
        other.format = format;
        if (width == kAnyWidth && MayEndWithSum(request, frame, other)) continue;
        other.width = width;
        const DecodedReply decoded = DecodeReply(request, std::nullopt, 0, frame, other);
        if (decoded.outcome != Outcome::ok) continue;
        return ReadAs(request, decoded, settings, other);
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Answer> ReadPrinted(const Command& request, View frame, const Settings& settings) {
  const auto reply = ParseReply(frame, ReplyVariant(request.text, settings));
  if (!reply || reply->ambiguous || reply->lead == '?' || request.broadcast) return std::nullopt;
  if (auto answer = ReadSample(request, frame, *reply, settings)) return answer;
  if (auto answer = ReadTenDigits(request, *reply)) return answer;
  if (auto answer = ReadShortCounter(request, frame, *reply)) return answer;
  if (auto answer = ReadFifteenCharacters(request, *reply)) return answer;
  if (auto answer = ReadLongStatus(request, *reply)) return answer;
  if (auto answer = ReadWithOtherSettings(request, frame, *reply, settings)) return answer;
  return ReadAddressed(request, *reply, settings);
}

}  // namespace baudgate::protocols::dcon
