// Random hours in which somebody changes the settings of devices and the devices themselves under
// the gateway. What is there after each change is a twin of its own; the test knows what that one
// means. No reading may be good that it does not mean, from one slow period after the change on,
// and by then a contradiction has to be named.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gateway/bus/points/point_store.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/protocol.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/spabus/protocol.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

constexpr Duration kSlow = 10s;
constexpr std::int64_t kMeterSerial = 9020001;
constexpr std::int64_t kWrongSerial = 7654321;

/// A device that may be there, as it differs from the right one.
struct Oddity {
  std::string name;
  std::function<void(config::Device&)> options = [](config::Device&) {};
  std::function<void(Twin&)> settings = [](Twin&) {};
  std::vector<std::pair<std::string, std::string>> says{};  ///< text points by name
  /// What a number of the point means, times what the right device means; nothing: no such thing.
  std::function<std::optional<double>(const config::Point& point)> means =
      [](const config::Point&) { return std::nullopt; };
  bool is_named = true;    ///< state or trouble tell of it
  bool in_place = true;    ///< may happen without a silence: a setting, not another device
  Duration shows = kSlow;  ///< by when
};

struct Case {
  std::string name;
  Setup setup;
  std::vector<Oddity> oddities;
};

void PrintTo(const Case& which, std::ostream* out) { *out << which.name; }

std::function<void(config::Device&)> Option(const std::string& key, config::OptionValue value) {
  return [=](config::Device& device) { device.options.Set(key, value); };
}

/// Factor 1 for all points but one input.
std::function<std::optional<double>(const config::Point&)> AllBut(const std::string& input) {
  return [=](const config::Point& point) {
    return point.read == input ? std::nullopt : std::optional(1.0);
  };
}

std::function<void(Twin&)> InputType(const std::string& type) {
  return
      [=](Twin& twin) { twin.Answer(protocols::dcon::BuildRequest("$7C1R" + type, 1, false), {}); };
}

Setup SetupOf(const Protocol& protocol, const std::string& profile) {
  Setup setup;
  setup.protocol = &protocol;
  setup.profile = profile;
  setup.serial = protocol.serial;
  setup.addresses = {"1"};
  return setup;
}

std::vector<Case> Cases() {
  const auto volts = [](const config::Point& point) {
    return std::optional(point.unit == "V" ? 0.001 : 1.0);
  };
  std::vector<Case> cases;
  cases.push_back({"Dcon7017",
                   SetupOf(DconProtocol(), "icpdas-i-7017"),
                   {{.name = "percent", .options = Option("format", std::string("percent"))},
                    {.name = "hex", .options = Option("format", std::string("hex"))},
                    {.name = "checksum", .options = Option("checksum", true), .shows = 1min},
                    {.name = "milliamperes", .says = {{"configuration", "0D0600"}}},
                    {.name = "thermocouples", .says = {{"configuration", "0F0600"}}},
                    {.name = "millivolts",
                     .says = {{"configuration", "0B0600"}},
                     .means = volts,
                     .is_named = false},
                    {.name = "one input less",
                     .options = Option("enable_mask", std::int64_t{0xFE}),
                     .says = {},
                     .means = AllBut("#[0]"),
                     .is_named = false},
                    {.name = "a 7060",
                     .says = {{"module_name", "7060"}, {"configuration", "400600"}},
                     .in_place = false}}});
  cases.push_back({"Dcon4017Plus",
                   SetupOf(DconProtocol(), "adam-4017plus"),
                   {{.name = "input 1 in mA",
                     .settings = InputType("0D"),
                     .means = AllBut("#[1]"),
                     .shows = kSlow + 2s},
                    {.name = "input 1 in mV",
                     .settings = InputType("0C"),
                     .means =
                         [](const config::Point& point) {
                           return std::optional(point.read == "#[1]" ? 0.001 : 1.0);
                         },
                     .is_named = false,
                     .shows = kSlow + 2s},
                    {.name = "percent", .options = Option("format", std::string("percent"))}}});
  cases.push_back({"Spa",
                   SetupOf(SpabusProtocol(), "spaj140c"),
                   {{.name = "another relay",
                     .says = {{"type_designation", "SPAU 130 C"}},
                     .in_place = false}}});
  cases.push_back({"Set4tm",
                   SetupOf(Set4tmProtocol(), "set-4tm.03m"),
                   {{.name = "another meter",
                     .options = Option("serial_number", kWrongSerial),
                     .in_place = false}}});
  return cases;
}

class RightValues : public ::testing::TestWithParam<Case> {
 protected:
  RightValues() : random_(20261123) {
    config::Line line = LineOf(GetParam().setup);
    config::Device& device = line.devices[0];
    device.slow = kSlow;
    device.identity.others = {{config::SpokenName("7060"), "icpdas-i-7060"},
                              {config::SpokenName("SPAU 130 C"), "spau130c"}};
    if (GetParam().setup.protocol->name == "set4tm")
      device.options.Set("serial_number", kMeterSerial);
    line.options = device.options;
    std::vector<config::Device> others;
    for (const Oddity& oddity : GetParam().oddities) {
      others.push_back(device);
      oddity.options(others.back());
    }
    line_ = std::make_unique<VirtualLine>(std::move(line), std::vector{GetParam().setup.protocol},
                                          std::move(others));
    line_->keep_sent = false;
    for (std::size_t twin = 0; twin <= GetParam().oddities.size(); ++twin) SetUp(twin);
  }

  const config::Device& device() { return line_->store().device(0); }
  const Oddity& OddityOf(std::size_t twin) { return GetParam().oddities[twin - 1]; }

  /// All measure the same numbers, whatever they mean by them.
  void SetUp(std::size_t twin) {
    VirtualLine::WireTwin& wired = line_->twin(twin);
    for (std::size_t i = 0; i < device().points.size(); ++i) {
      const config::Point& point = device().points[i];
      if (!point.simulate) continue;
      const config::Simulate& shows = *point.simulate;
      Value value = ((shows.low - point.offset) / point.scale).ToDouble();
      if (point.type == config::Type::boolean) value = shows.low != 0;
      if (shows.text) value = *shows.text;
      if (twin > 0) {
        for (const auto& [name, text] : OddityOf(twin).says) {
          if (point.name == name) value = text;
        }
      }
      wired.values.Set(i, value);
    }
    if (twin > 0) OddityOf(twin).settings(*wired.twin);
    wired.manner.dead = twin > 0;
  }

  bool AllGood() {
    bool good = true;
    line_->store().Read(0, [&](const DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        good = good && IsGood(QualityAt(record, i, line_->now().instant));
      }
    });
    return good;
  }

  void LearnTruth() {
    line_->Open();
    ASSERT_TRUE(line_->RunUntil([this] { return AllGood(); }, 5min));
    line_->store().Read(0, [&](const DeviceRecord& record) {
      for (const PointRecord& point : record.points) truth_.push_back(point.value);
    });
  }

  /// Another one is there from now on, after a silence where it is another device.
  void Change(std::size_t twin) {
    const bool in_place = (twin == 0 || OddityOf(twin).in_place) &&
                          (there_ == 0 || OddityOf(there_).in_place) && random_() % 2 == 0;
    line_->twin(there_).manner.dead = true;
    if (!in_place) line_->RunFor(30s + std::chrono::milliseconds(random_() % 60'000));
    shows_ = std::max(ShowsOf(there_), ShowsOf(twin));
    there_ = twin;
    since_ = line_->now().instant;
    line_->twin(there_).manner.dead = false;
  }
  Duration ShowsOf(std::size_t twin) { return twin == 0 ? kSlow : OddityOf(twin).shows; }

  /// Readings that were taken when the change must have been seen.
  void Look() {
    const Instant due = since_ + shows_ + kPoll;
    if (line_->now().instant < due || line_->twin(there_).manner.dead) return;
    line_->store().Read(0, [&](const DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        const config::Point& point = device().points[i];
        const bool number = point.type != config::Type::string;
        if (point.group != config::Group::fast || !number) continue;
        if (!IsGood(QualityAt(record, i, line_->now().instant))) continue;
        ++judged_;
        const auto factor = there_ == 0 ? std::optional(1.0) : OddityOf(there_).means(point);
        const double truth = ToDouble(truth_[i]);
        const double shown = ToDouble(record.points[i].value);
        if (factor && std::abs(shown - truth * *factor) <= std::abs(truth) * 1e-4 + 1e-6) continue;
        if (++wrong_ > 3) continue;
        ADD_FAILURE() << point.name << " shows " << shown << " as good, " << Name()
                      << " is there since " << FormatDuration(line_->now().instant - since_);
      }
    });
  }
  std::string Name() { return there_ == 0 ? "the right one" : OddityOf(there_).name; }

  void ExpectNamed() {
    const std::string trouble = line_->StatusOf(0).trouble;
    const bool named = there_ != 0 && OddityOf(there_).is_named;
    EXPECT_EQ(!trouble.empty(), named) << Name() << ": '" << trouble << "'";
    if (!named) return;
    bool reason = false;
    line_->store().Read(0, [&](const DeviceRecord& record) {
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        const Reason why = QualityAt(record, i, line_->now().instant).reason;
        reason = reason || why == Reason::other_module || why == Reason::swapped;
      }
    });
    // One that answers in the other checksum mode only may count as offline.
    reason = reason || line_->StatusOf(0).state == DeviceState::offline;
    EXPECT_TRUE(reason) << Name() << ": '" << trouble << "', state "
                        << static_cast<int>(line_->StatusOf(0).state) << ", "
                        << baudgate::Name(line_->QualityOf(0, 0));
  }

  static constexpr Duration kPoll = 6s;  // a poll, its repetitions and the questions before it

  std::mt19937 random_;
  std::unique_ptr<VirtualLine> line_;
  std::vector<Value> truth_;
  std::size_t there_ = 0;
  Instant since_{};
  Duration shows_ = kSlow;
  std::size_t judged_ = 0;
  std::size_t wrong_ = 0;
};

TEST_P(RightValues, NothingIsGoodThatTheDeviceDidNotMean) {
  LearnTruth();
  if (HasFatalFailure()) return;
  line_->always = [this] { Look(); };
  const Instant end = line_->now().instant + 1h;
  std::size_t changes = 0;
  while (line_->now().instant < end && !HasFailure()) {
    Change(there_ == 0          ? 1 + random_() % GetParam().oddities.size()
           : random_() % 3 != 0 ? 0
                                : 1 + random_() % GetParam().oddities.size());
    ++changes;
    line_->RunFor(shows_ + kPoll);
    ExpectNamed();
    line_->RunFor(std::chrono::milliseconds(random_() % 20'000));
  }
  EXPECT_GT(changes, 15U);
  Change(0);
  EXPECT_TRUE(line_->RunUntil([this] { return AllGood(); }, 5min)) << "the right one is back";
  EXPECT_GT(judged_, 1000U);
}

INSTANTIATE_TEST_SUITE_P(Lines, RightValues, ::testing::ValuesIn(Cases()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace baudgate
