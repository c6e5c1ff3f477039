// The descriptor of the DCON protocol: options, decoders, times, checks and functions.
#include "protocols/dcon/protocol.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/common/settings.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/rules.h"
#include "protocols/dcon/settings.h"
#include "protocols/dcon/twin.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Access;
using config::Point;
using config::Type;

Result<std::string> CanonicalAddress(std::string_view address) {
  const auto parsed = ParseAddress(address);
  if (!parsed) return Error{parsed.error()};
  return std::to_string(*parsed);
}

/// Refuses a fault code that is listed with two meanings, because only the first meaning would be
/// found.
Status CheckCodes(const Settings& settings) {
  const std::pair<const char*, const std::vector<std::string>&> lists[] = {
      {"over", settings.over}, {"under", settings.under}, {"open", settings.open}};
  for (std::size_t i = 0; i < std::size(lists); ++i) {
    for (std::size_t j = i + 1; j < std::size(lists); ++j) {
      for (const std::string& code : lists[j].second) {
        if (std::ranges::find(lists[i].second, code) == lists[i].second.end()) continue;
        return Error{"'" + code + "' is in '" + lists[i].first + "' and in '" + lists[j].first +
                     "'; list a code under one key only"};
      }
    }
  }
  return {};
}

Status CheckTypes(const Settings& settings) {
  for (const std::string& type : settings.types) {
    if (type.size() == 2 && ParseInteger<unsigned>(type, 16)) continue;
    return Error{"'" + type +
                 "' in 'types' is not a type code; write two hex digits in quotes, as \"08\""};
  }
  return {};
}

Status CheckDevice(const config::Device& device) {
  const Settings settings = ReadSettings(device.options);
  if (Status status = CheckTypes(settings); !status) return status;
  if (Status status = CheckCodes(settings); !status) return status;
  for (const Point& point : device.points) {
    const auto read = ParseRead(point.read);
    const bool indexed = read && read->select == ReadAddress::Select::index;
    if (settings.channels == 0 || !indexed || read->index < settings.channels) continue;
    return Error{"point '" + point.name + "' reads '" + point.read +
                 "', but 'channels: " + std::to_string(settings.channels) + "' ends at [" +
                 std::to_string(settings.channels - 1) + "]; correct one of the two"};
  }
  return {};
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// Adds a remark for each input whose unit no module of the listed types can measure.
void DoubtUnits(const config::Device& device, const Settings& settings,
                std::vector<ConfigRemark>& doubts) {
  if (settings.types.empty() || settings.channel_types || device.identity.ignore) return;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const Point& point = device.points[i];
    const auto read = ParseRead(point.read);
    if (point.access == Access::write || !read) continue;
    const bool fits = std::ranges::any_of(settings.types, [&](const std::string& type) {
      const auto code = ParseInteger<std::uint8_t>(type, 16);
      return !code || Measures(*code, *read, point.unit, settings);
    });
    if (fits) continue;
    doubts.push_back(
        {i, "no module of the types that the profile lists (" + Joined(settings.types) +
                ") measures '" + point.unit +
                "', so the point will never have a good value; correct the unit, or 'types'"});
  }
}

std::vector<ConfigRemark> DoubtsOf(const config::Device& device) {
  std::vector<ConfigRemark> doubts;
  const auto address = ParseAddress(device.address);
  if (address && *address == 0) {
    doubts.push_back({kNoPoint,
                      "address 0 is also the address of every module that starts with INIT* "
                      "grounded; give this module another address, 1 to 255"});
  }
  const Settings settings = ReadSettings(device.options);
  if (settings.host_watchdog > Duration::zero() && device.poll > settings.host_watchdog) {
    doubts.push_back(
        {kNoPoint, device.address + " is polled every " + FormatDuration(device.poll) +
                       ", but ~** is sent only with polls, and the modules need it every " +
                       FormatDuration(settings.host_watchdog) +
                       " (host_watchdog), so watchdogs of modules may trip; poll a "
                       "device of this line more often"});
  }
  DoubtUnits(device, settings, doubts);
  return doubts;
}

bool HasTotals(const config::Device& device) {
  return std::ranges::any_of(device.points, [](const Point& point) {
    const auto read = ParseRead(point.read);
    return read && read->total;
  });
}

config::RawNumbers RawNumbersOf(const config::Device& device, const Point& point) {
  const auto read = ParseRead(point.read);
  const Settings settings = ReadSettings(device.options);
  // With the option full_scale, hex words become decimal numbers of any size, so there is no range.
  if (!read || settings.full_scale != 0) return {};
  return NumbersOf(*read, settings.hex_unsigned);
}

std::optional<std::vector<std::size_t>> ChangedPoints(View request, const config::Device& device) {
  const auto command = ParseRequest(request, ReadSettings(device.options).checksum);
  const auto address = ParseAddress(device.address);
  if (!command || !address) return std::nullopt;
  std::vector<std::size_t> changed;
  if (command->broadcast || command->address != *address) return changed;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (Changes(command->text, device.points[i])) changed.push_back(i);
  }
  return changed;
}

constexpr TimingRule kTiming = {.quiet = {.least = 5ms},
                                .reply = {.least = 300ms},
                                .gap = {.least = 50ms, .characters = 20},
                                .drain = {.least = 100ms, .characters = 20},
                                .longest = kMaxFrame};

/// DCON replies contain numbers with signs, hex digits, names and versions, but never the
/// characters in never_in_reply.
constexpr config::Traits kTraits = {
    .speaks_text = true,
    .is_unchecked = [](const config::Options& options) { return !options.Flag("checksum"); },
    .never_in_reply = "()*/,:;<=\\"};

std::unique_ptr<Bus> MakeLine() { return std::make_unique<DconBus>(); }

std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const ParsedOptions& options, Bus* bus) {
  return std::make_unique<DconConversation>(device, options.As<Settings>(),
                                            static_cast<DconBus&>(*bus));
}

std::unique_ptr<Twin> MakeTwin(const config::Device& device, TwinValues& values) {
  return std::make_unique<DconTwin>(device, values);
}

}  // namespace
}  // namespace baudgate::protocols::dcon

namespace baudgate::protocols {

using namespace protocols::dcon;  // NOLINT

const Protocol& DconProtocol() {
  static const Protocol kProtocol = {
      .name = "dcon",
      .title = "DCON (ICP DAS, Advantech ADAM ASCII, OWEN), master",
      .also_called = "owen adam icpdas icp-das advantech",
      .options = OptionTable(),
      .decoders = DecoderTable(),
      .canonical_address = CanonicalAddress,
      .check_point = CheckPoint,
      .raw_numbers = RawNumbersOf,
      .check_device = CheckDevice,
      .doubts = DoubtsOf,
      .serial = {},  // default 9600 8N1, the factory setting of most modules
      .timing = kTiming,
      .request_rule = RequestRule,
      .reply_rule = ReplyRule,
      .parse = ParseWith<ReadSettings>,
      .expect = kWithSettings<Expect>,
      .changes = ChangedPoints,
      .recognise = kWithSettings<Recognise>,
      .foreign = ForeignDcon,
      .weak_check = true,
      .traits = kTraits,
      .remembers = HasTotals,
      .scan = &kScan,
      .telegram = &kTelegram,
      .make_bus = MakeLine,
      .make_conversation = MakeConversation,
      .make_twin = MakeTwin,
  };
  return kProtocol;
}

}  // namespace baudgate::protocols
