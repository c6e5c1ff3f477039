// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/printed.h"

#include <algorithm>

#include "gateway/base/checksum.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr std::size_t kAnyWidth = 0;

/// The last two characters are the checksum that nobody has configured: they belong to no number.
bool EndsWithItsSum(View frame) {
  const std::string_view text = Trim(AsText(frame));
  if (text.size() < 3) return false;
  return HexByte(Sum8(frame.first(text.size() - 2))) == text.substr(text.size() - 2);
}

/// 'n' stands for one hex digit, a '*' at the end for any rest.
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

/// What follows `!AA`.
struct Behind {
  std::string_view command;
  enum class Kind : std::uint8_t { flag, hex, decimal, number, text } kind;
  std::size_t digits;  ///< of flag, hex and decimal
  std::string_view what;
};

using Kind = Behind::Kind;
constexpr Behind kBehind[] = {
    {"$5", Kind::flag, 1, "restarted since last asked"},
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

/// A number of the usual seven characters, or without its sign.
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

/// `!01C0R08` and, on ADAM-4024, `!01C030`: the type code of one channel.
std::optional<Reading> ReadChannelType(const Command& request, std::string_view text) {
  if (!FitsPrinted("$8Cn", request.text) || !text.starts_with(request.text.substr(2))) {
    return std::nullopt;
  }
  text.remove_prefix(2);
  if (text.starts_with('R')) text.remove_prefix(1);
  if (text.size() != 2 || !IsHexText(text)) return std::nullopt;
  return Labelled(request, "type code", std::string(text));
}

/// `!AA` alone is "done"; more is read by the table, and what the table does not have is text.
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
      answer.reason = "confirmed by !" + who + " in place of >";
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

/// What `#**` has latched: `>AAS(data)` of an analog module, `!S(data)00` of a digital one; S is 1
/// when the sample is fetched for the first time.
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

/// The decimal counter of NuDAM, `#AAND`: ten digits after `>` or `!AA`.
std::optional<Answer> ReadTenDigits(const Command& request, const Reply& reply) {
  if (!FitsPrinted("#nD", request.text)) return std::nullopt;
  std::string_view text = reply.body;
  if (text.size() == 12 && text.starts_with(HexByte(request.address))) text.remove_prefix(2);
  if (reply.lead == '?' || text.size() != 10 || !IsDecimalText(text)) return std::nullopt;
  Answer answer;
  answer.readings.push_back(Labelled(request, "counter", *ParseInteger<std::uint64_t>(text)));
  return answer;
}

/// The counter of a digital input that does not fill up with zeros: `#AAN` → `!AA` and fewer than
/// five digits.
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

/// OWEN 110-224.1T: fifteen characters of text, the value in the first nine, the frequency in the
/// last five.
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

/// ND-6058 tells 40 bits where others tell 16.
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
  if (other.data_address && !settings.data_address) answer.reason = "the reply carries the address";
  if (other.width != settings.width) {
    answer.reason += answer.reason.empty() ? "" : "; ";
    answer.reason += "its numbers do not have the usual " + std::to_string(settings.width) +
                     " characters: the option is width: 0";
  }
  const bool joined = decoded.form == Form::numbers || decoded.form == Form::words;
  for (const Field& field : decoded.fields) {
    Reading reading = Labelled(request, {}, field.value, field.quality);
    if (joined) reading.label += "[" + std::to_string(field.channel) + "]";
    answer.readings.push_back(std::move(reading));
  }
  return answer;
}

/// Numbers of the usual width and two characters more: these may be a checksum.
bool MayEndWithSum(const Command& request, View frame, const Settings& settings) {
  if (EndsWithItsSum(frame)) return true;
  const std::string_view text = Trim(AsText(frame));
  if (text.size() < 3) return false;
  const Bytes shorter = ToBytes(std::string(text.substr(0, text.size() - 2)) + "\r");
  return DecodeReply(request, std::nullopt, 0, shorter, settings).outcome == Outcome::ok;
}

/// Numbers in hex words or of another width, and replies with `>` that carry the address (TRP-C68):
/// as if the options said so.
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
