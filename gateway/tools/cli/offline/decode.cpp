// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/decode.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/offline/make_line.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

struct Captures {
  std::vector<records::TracedDevice> devices;
  std::vector<diagnosis::Capture> exchanges;
};

/// True if `piece` belongs to the message in `capture`. A pause of more than kApart ends a message
/// that was sent unasked.
bool Continues(const diagnosis::Capture& capture, const diagnosis::TraceLine& piece) {
  if (!capture.unasked || piece.time.empty()) return true;
  return diagnosis::Between(capture.heard_at, diagnosis::TimeOfDay(piece.time)) <=
         diagnosis::kApart;
}

diagnosis::Capture Begun(const diagnosis::TraceLine& marked, int number,
                         const diagnosis::ParsedHex& hex) {
  diagnosis::Capture capture;
  capture.line = number;
  capture.request = hex.bytes;
  capture.request_masked = hex.masked;
  capture.time = marked.time;
  capture.device = marked.device;
  capture.last = true;
  return capture;
}

diagnosis::Capture Heard(const diagnosis::TraceLine& marked, int number,
                         const diagnosis::ParsedHex& hex) {
  return {.unasked = true,
          .line = number,
          .reply = hex.bytes,
          .reply_masked = hex.masked,
          .time = std::string(marked.time),
          .heard_at = diagnosis::TimeOfDay(marked.time),
          .device = std::string(marked.device),
          .last = true};
}

Status TakeLine(std::string_view line, int number, std::vector<diagnosis::Capture>& captures) {
  const diagnosis::TraceLine marked = diagnosis::ReadTraceLine(line);
  const bool of_trace = !marked.time.empty();
  if (of_trace && !captures.empty()) captures.back().last = false;
  if (marked.mark != '<' && !captures.empty() && captures.back().unasked) {
    captures.back().ended = true;
  }
  // `line` tells the outcome of the last capture only if it is about the same device and the
  // capture has not ended; else records of the trace were lost.
  const bool known =
      !captures.empty() && !captures.back().ended && captures.back().device == marked.device;
  if (marked.mark == '=' && of_trace && known) {
    diagnosis::Capture& capture = captures.back();
    capture.told = diagnosis::OutcomeOf(marked.rest);
    capture.why = diagnosis::ReasonOf(marked.rest);
    capture.ended = true;
  }
  if (marked.mark != '>' && marked.mark != '<') return {};
  const auto hex = diagnosis::ParseMaskedHex(marked.rest);
  if (!hex) return Error{"the text after '>' or '<' is not hex; write two digits for each byte"};
  const bool continues =
      !captures.empty() && !captures.back().ended && Continues(captures.back(), marked);
  if (marked.mark == '>') {
    captures.push_back(Begun(marked, number, *hex));
  } else if (continues) {
    captures.back().last = true;
    captures.back().heard_at = diagnosis::TimeOfDay(marked.time);
    Append(captures.back().reply, hex->bytes);
    captures.back().reply_masked = captures.back().reply_masked || hex->masked;
  } else {
    captures.push_back(Heard(marked, number, *hex));
  }
  return {};
}

/// The error contains the number of the line that is not hex.
Result<Captures> ReadCaptures(std::istream& in) {
  Captures captures;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (auto device = records::ReadTracedDevice(Trim(line)))
      captures.devices.push_back(std::move(*device));
    if (const Status taken = TakeLine(line, number, captures.exchanges); !taken) {
      return Error{"line " + std::to_string(number) + ": " + taken.error()};
    }
  }
  if (in.bad()) return Error{"the captures cannot be read; check that the path is a file"};
  return captures;
}

/// The error names the wrong protocol, profile or option. `catalog` must outlive the decoder.
Result<diagnosis::ExchangeDecoder> MakeDecoder(const records::TracedDevice& traced,
                                               const config::Catalog& catalog) {
  // The decoder gets the address from each request; the address given here must only be valid.
  auto line =
      MakeLine({.protocol = traced.protocol,
                .devices = {{.profile = traced.profile, .address = "1", .set = traced.set}}},
               catalog);
  if (!line) return Error{line.error()};
  const protocols::Protocol& protocol = *catalog.FindProtocol(line->devices.front().protocol);
  return diagnosis::ExchangeDecoder(std::move(*line), protocol);
}

}  // namespace

diagnosis::Decoders DecodersOf(const std::vector<std::string>& head,
                               const config::Catalog& catalog) {
  diagnosis::Decoders decoders;
  for (const std::string& line : head) {
    const auto device = records::ReadTracedDevice(line);
    if (!device) continue;
    auto decoder = MakeDecoder(*device, catalog);
    if (decoder) decoders.emplace(device->name, std::move(*decoder));
  }
  return decoders;
}

namespace {

using Json = nlohmann::ordered_json;

Json ToJson(const Value& value) {
  return std::visit(
      [](const auto& held) -> Json {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<T, std::monostate>) {
          return nullptr;
        } else if constexpr (std::is_same_v<T, double>) {
          return std::isfinite(held) ? Json(held) : Json(nullptr);
        } else {
          return held;
        }
      },
      value);
}

Json ToJson(const diagnosis::DecodedExchange& decoded, const diagnosis::Capture& capture) {
  Json values = Json::array();
  for (const diagnosis::DecodedValue& value : decoded.values) {
    Json json = {{"point", value.name}, {"value", ToJson(value.value)}};
    if (value.is_point) json["unit"] = value.unit;
    json["quality"] = value.quality.word();
    values.push_back(std::move(json));
  }
  Json json = {{"outcome", Name(decoded.outcome)}, {"reason", decoded.reason}, {"values", values}};
  if (!capture.time.empty()) json.update({{"time", capture.time}, {"device", capture.device}});
  return json;
}

/// Returns a line such as "04:05:06.123456 ai-1: corrupt: checksum", and a line for each value.
std::string ToProse(const diagnosis::DecodedExchange& decoded, const diagnosis::Capture& capture,
                    std::size_t width) {
  std::string head = capture.time.empty() ? "" : capture.time + " " + capture.device + ": ";
  head += decoded.outcome == Outcome::none ? "not known" : Name(decoded.outcome);
  if (!decoded.reason.empty()) head += ": " + decoded.reason;
  std::string text = WrapSentence(Harmless(head), width);
  for (const diagnosis::DecodedValue& value : decoded.values)
    text += "  " + ValueText(value) + "\n";
  return text;
}

/// Contains a decoder for each device in the head of the trace. If the command line names a
/// protocol or a profile, the head is ignored.
class TracedDecoders {
 public:
  TracedDecoders(const DecodeOptions& options, const config::Catalog& catalog)
      : options_(options), catalog_(catalog) {}

  Status Begin(const std::vector<records::TracedDevice>& devices) {
    for (const records::TracedDevice& device : devices) {
      if (options_.device.empty() || options_.device == device.name) devices_[device.name] = device;
    }
    if (!options_.protocol.empty() || !options_.profile.empty()) devices_.clear();
    if (!devices_.empty()) return {};
    if (!options_.protocol.empty() || !options_.profile.empty()) return For("").first;
    return Error{
        "the protocol is unknown, because the captures lack the head that 'baudgate trace' prints; "
        "add --protocol"};
  }

  /// Returns the decoder of a device, or null and the reason. All devices that the head does not
  /// contain share one decoder.
  std::pair<Status, diagnosis::ExchangeDecoder*> For(const std::string& device) {
    const auto known = devices_.find(device);
    const std::string key = known == devices_.end() ? "" : device;
    auto found = decoders_.find(key);
    if (found == decoders_.end()) {
      records::TracedDevice traced = key.empty() ? records::TracedDevice{} : known->second;
      if (key.empty()) traced.protocol = ProtocolOfOthers();
      if (!options_.profile.empty()) traced.profile = options_.profile;
      traced.set.insert(traced.set.end(), options_.set.begin(), options_.set.end());
      auto decoder = MakeDecoder(traced, catalog_);
      if (!decoder) return {Error{decoder.error()}, nullptr};
      found = decoders_.emplace(key, std::move(*decoder)).first;
    }
    return {Status(), &found->second};
  }

  /// Returns the decoder of a device that sends unasked; null: there is no such device, or no
  /// decoder for it can be made.
  diagnosis::ExchangeDecoder* Speaker() {
    std::vector<std::string> names;
    for (const auto& [name, device] : devices_) names.push_back(name);
    if (names.empty()) names.emplace_back();
    for (const std::string& name : names) {
      diagnosis::ExchangeDecoder* const decoder = For(name).second;
      if (decoder != nullptr && decoder->Listens()) return decoder;
    }
    return nullptr;
  }

 private:
  /// Returns the protocol of devices that the trace head does not contain: slaves to which only
  /// Modbus routes lead. They use the protocol of their line.
  std::string ProtocolOfOthers() const {
    if (!options_.protocol.empty() || devices_.empty()) return options_.protocol;
    return devices_.begin()->second.protocol;
  }

  const DecodeOptions& options_;
  const config::Catalog& catalog_;
  std::map<std::string, records::TracedDevice> devices_;
  std::map<std::string, diagnosis::ExchangeDecoder> decoders_;
};

}  // namespace

int RunDecode(const DecodeOptions& options, const config::Catalog& catalog, std::istream& in,
              std::ostream& out, std::ostream& err) {
  const auto fail = [&err](int code, const std::string& why) {
    err << "baudgate: " << why << "\n";
    return code;
  };
  TracedDecoders decoders(options, catalog);
  if (!options.protocol.empty() || !options.profile.empty()) {
    if (const Status begun = decoders.Begin({}); !begun) {
      return fail(kExitBadConfiguration, begun.error());
    }
  }
  const auto captures = ReadCaptures(in);
  if (!captures) return fail(kExitUsage, captures.error());
  if (const Status begun = decoders.Begin(captures->devices); !begun) {
    return fail(kExitUsage, begun.error());
  }
  const auto print = [&](const diagnosis::DecodedExchange& decoded,
                         const diagnosis::Capture& capture) {
    if (options.prose) {
      out << ToProse(decoded, capture, options.width);
    } else {
      out << ToJson(decoded, capture).dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
    }
  };
  bool any = false;
  for (const diagnosis::Capture& capture : captures->exchanges) {
    if (capture.unasked) {
      diagnosis::ExchangeDecoder* const speaker = decoders.Speaker();
      // A trace can begin in the middle of an exchange. Bytes without a request are then skipped.
      if (speaker == nullptr && !capture.time.empty()) continue;
      if (speaker == nullptr) {
        return fail(kExitUsage, "line " + std::to_string(capture.line) +
                                    ": the reply has no request (\"> hex\") before it, and devices "
                                    "of this protocol send nothing by themselves");
      }
      any = true;
      if (capture.reply_masked) continue;
      for (const diagnosis::HeardMessage& message : speaker->Hear(capture.reply)) {
        print(message.decoded, capture);
      }
      continue;
    }
    any = true;
    if (!options.device.empty() && capture.device != options.device) continue;
    const auto [status, decoder] = decoders.For(capture.device);
    if (decoder == nullptr) return fail(kExitBadConfiguration, status.error());
    print(decoder->Decode(capture), capture);
  }
  if (any) return kExitDone;
  return fail(kExitUsage, "the captures have no exchange; write lines \"> hex\" and \"< hex\"");
}

}  // namespace baudgate::tools
