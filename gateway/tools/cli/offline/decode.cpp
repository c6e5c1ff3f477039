// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/decode.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/tools/cli/offline/captures.h"
#include "gateway/tools/cli/offline/traced_decoder.h"
#include "gateway/tools/terminal/wrap.h"

namespace baudgate {
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

Json ToJson(const DecodedExchange& decoded, const Capture& capture) {
  Json values = Json::array();
  for (const DecodedValue& value : decoded.values) {
    Json json = {{"point", value.name}, {"value", ToJson(value.value)}};
    if (value.is_point) json["unit"] = value.unit;
    json["quality"] = value.quality.word();
    values.push_back(std::move(json));
  }
  Json json = {{"outcome", Name(decoded.outcome)}, {"reason", decoded.reason}, {"values", values}};
  if (!capture.time.empty()) json.update({{"time", capture.time}, {"device", capture.device}});
  return json;
}

/// "04:05:06.123456 ai-1: corrupt: checksum", and a line for each value.
std::string ToProse(const DecodedExchange& decoded, const Capture& capture, std::size_t width) {
  std::string head = capture.time.empty() ? "" : capture.time + " " + capture.device + ": ";
  head += decoded.outcome == Outcome::none ? "not known" : Name(decoded.outcome);
  if (!decoded.reason.empty()) head += ": " + decoded.reason;
  std::string text = WrapSentence(Harmless(head), width);
  for (const DecodedValue& value : decoded.values) text += "  " + ValueText(value) + "\n";
  return text;
}

/// A decoder for each device that the head names; what the words say holds for all.
class TracedDecoders {
 public:
  TracedDecoders(const DecodeOptions& options, const config::Catalog& catalog)
      : options_(options), catalog_(catalog) {}

  Status Begin(const std::vector<TracedDevice>& devices) {
    for (const TracedDevice& device : devices) {
      if (options_.device.empty() || options_.device == device.name) devices_[device.name] = device;
    }
    if (!options_.protocol.empty() || !options_.profile.empty()) devices_.clear();
    if (!devices_.empty()) return {};
    if (!options_.protocol.empty() || !options_.profile.empty()) return For("").first;
    return Error{"--protocol is missing, and no head of a trace names one"};
  }

  /// Null: it cannot be had, and the status says why.
  std::pair<Status, ExchangeDecoder*> For(const std::string& device) {
    const auto known = devices_.find(device);
    const std::string key = known == devices_.end() ? "" : device;
    auto found = decoders_.find(key);
    if (found == decoders_.end()) {
      TracedDevice traced = key.empty() ? TracedDevice{} : known->second;
      if (key.empty()) traced.protocol = ProtocolOfOthers();
      if (!options_.profile.empty()) traced.profile = options_.profile;
      traced.set.insert(traced.set.end(), options_.set.begin(), options_.set.end());
      auto decoder = MakeDecoder(traced, catalog_);
      if (!decoder) return {Error{decoder.error()}, nullptr};
      found = decoders_.emplace(key, std::move(*decoder)).first;
    }
    return {Status(), &found->second};
  }

  /// The decoder of the device that speaks by itself; null: there is none, or not here.
  ExchangeDecoder* Speaker() {
    std::vector<std::string> names;
    for (const auto& [name, device] : devices_) names.push_back(name);
    if (names.empty()) names.emplace_back();
    for (const std::string& name : names) {
      ExchangeDecoder* const decoder = For(name).second;
      if (decoder != nullptr && decoder->Listens()) return decoder;
    }
    return nullptr;
  }

 private:
  /// Slaves that only routes reach are not in the head: they speak what the others of the line do.
  std::string ProtocolOfOthers() const {
    if (!options_.protocol.empty() || devices_.empty()) return options_.protocol;
    return devices_.begin()->second.protocol;
  }

  const DecodeOptions& options_;
  const config::Catalog& catalog_;
  std::map<std::string, TracedDevice> devices_;
  std::map<std::string, ExchangeDecoder> decoders_;
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
  const auto print = [&](const DecodedExchange& decoded, const Capture& capture) {
    if (options.prose) {
      out << ToProse(decoded, capture, options.width);
    } else {
      out << ToJson(decoded, capture).dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
    }
  };
  bool any = false;
  for (const Capture& capture : captures->exchanges) {
    if (capture.unasked) {
      ExchangeDecoder* const speaker = decoders.Speaker();
      // A trace may begin in the midst of an exchange, and has stray bytes.
      if (speaker == nullptr && !capture.time.empty()) continue;
      if (speaker == nullptr) {
        return fail(kExitUsage, "line " + std::to_string(capture.line) +
                                    ": a reply before any request (\"> hex\"), and no device "
                                    "that speaks by itself");
      }
      any = true;
      if (capture.reply_masked) continue;
      for (const HeardMessage& message : speaker->Hear(capture.reply)) {
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
  return fail(kExitUsage, "no exchange here; write lines \"> hex\" and \"< hex\"");
}

}  // namespace baudgate
