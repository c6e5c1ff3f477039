// Tests that the values of simulated devices arrive at `baudgate watch` and at another vendor's
// subscriber.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <regex>
#include <set>
#include <sstream>

#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using Samples = std::map<std::string, Json>;

class OnDds : public ThreeDevices {
 protected:
  std::vector<std::string> WatchWords() const {
    return {"watch", "--domain", std::to_string(domain()), "--gateway", gateway(), "--json"};
  }

  Samples WatchOnce() const {
    auto words = WatchWords();
    words.push_back("--once");
    const Finished watch = Command(words);
    EXPECT_EQ(watch.code, 0) << watch.errors;
    return Parse(watch.output);
  }

  static Samples Parse(const std::string& lines) {
    Samples samples;
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);) {
      const Json sample = Json::parse(line, nullptr, false);
      if (!sample.is_object()) continue;
      samples[sample["device"].get<std::string>() + " " + sample["point"].get<std::string>()] =
          sample;
    }
    return samples;
  }

  std::size_t PointCount() const {
    const Finished map = Command({"map", "--json", "-c", (directory() / "baudgate.yaml").string()});
    return Json::parse(map.output)["points"].size();
  }

  std::unique_ptr<Child> StartCyclone(std::size_t count, bool until_gone) const {
    std::vector<std::string> words = {
        CYCLONE_SUBSCRIBER, "--domain", std::to_string(domain()), "--count", std::to_string(count),
        "--seconds",        "30"};
    if (until_gone) words.push_back("--gone");
    return std::make_unique<Child>(words, directory());
  }
};

TEST_F(OnDds, WatchAndAForeignSubscriberSeeTheSameValues) {
  StartAll(true);
  const std::size_t points = PointCount();
  Samples samples;
  ASSERT_TRUE(Eventually([&] {
    samples = WatchOnce();
    return samples.size() == points && samples["relay-1 current_l3"]["quality"] == 0xC0 &&
           samples["io-1 input_5"]["quality"] == 0xC0 &&
           samples["meter-1 energy_yesterday_active_import"]["quality"] == 0xC0;
  })) << samples.size()
      << " of " << points;
  EXPECT_EQ(samples["relay-1 current_l3"]["value"], 63.0);
  EXPECT_EQ(samples["relay-1 current_l3"]["unit"], "xIn");
  EXPECT_EQ(samples["relay-1 output_trip"]["value"], 1.0);
  EXPECT_EQ(samples["relay-1 type_designation"]["text"], "SPCJ 4D29");
  EXPECT_EQ(samples["io-1 input_5"]["value"], -101.5);
  EXPECT_EQ(samples["meter-1 frequency"]["value"], 50.03125);
  EXPECT_DOUBLE_EQ(samples["meter-1 energy_yesterday_active_import"]["value"].get<double>(),
                   12345.6);
  EXPECT_EQ(samples["meter-1 frequency"]["gateway"], gateway());

  const auto cyclone = StartCyclone(points, false);
  EXPECT_EQ(cyclone->WaitForEnd(40s), 0) << cyclone->Errors();
  const std::string heard = cyclone->Output();
  EXPECT_THAT(heard, HasSubstr("relay-1 current_l3 63 192 xIn\n"));
  EXPECT_THAT(heard, HasSubstr("io-1 input_5 -101.5 192 "));
  EXPECT_THAT(heard, HasSubstr("meter-1 frequency 50.03125 192 Hz\n"));
}

TEST_F(OnDds, AnOrderlyStopIsSeenByBothSubscribers) {
  StartTwins();
  // Without the simulated device, one device is missing. Its points are announced and removed like
  // all points.
  io.reset();
  daemon = StartDaemon(Yaml(true));
  const std::size_t points = PointCount();
  const auto watch = Start(WatchWords());
  const auto cyclone = StartCyclone(points, true);
  const auto heard = [&] {
    const std::string text = cyclone->Output();
    std::set<std::string> distinct;
    std::istringstream stream(text.substr(0, text.rfind('\n') + 1));
    for (std::string device, point, rest; stream >> device >> point; std::getline(stream, rest)) {
      if (device != "gateway") distinct.insert(device + " " + point);
    }
    return distinct.size();
  };
  ASSERT_TRUE(Eventually([&] { return heard() == points; })) << heard() << " of " << points;
  ASSERT_TRUE(Eventually([&] { return Parse(watch->Output()).size() == points; }));
  const std::string read = "meter-1 frequency 50.03125 192 Hz\n";
  ASSERT_TRUE(Eventually([&] { return cyclone->Output().find(read) != std::string::npos; }));

  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
  EXPECT_EQ(cyclone->WaitForEnd(40s), 0) << cyclone->Errors();
  EXPECT_THAT(cyclone->Output(), HasSubstr("gone meter-1 frequency\n"));
  // The gateway waits only briefly for subscribers at its end, so a slow subscriber can miss
  // samples.
  EXPECT_TRUE(std::regex_search(cyclone->Output(), std::regex("(meter|relay)-1 \\w+ [0-9.]+ 8 ")))
      << "no point says that it is not connected any more";
  EXPECT_TRUE(Eventually([&] {
    for (const auto& [key, sample] : Parse(watch->Output())) {
      if (sample.value("gone", "") != "no_writers") return false;
    }
    return true;
  })) << watch->Output();
}

TEST_F(OnDds, ASecondGatewayThatCannotStartDoesNotDisturbTheFirst) {
  io = StartTwin("io", "module", "1");
  daemon = StartDaemon(Yaml(true));
  const auto watch = Start(WatchWords());
  const auto seq = [&] {
    const Samples samples = Parse(watch->Output());
    const auto found = samples.find("io-1 input_5");
    return found == samples.end() ? 0 : found->second.value("seq", 0);
  };
  ASSERT_TRUE(Eventually([&] { return seq() > 0; }));
  // Subscribers would mistake the samples of a second gateway with this name for those of the
  // first.
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(Command({"run", "-c", (directory() / "baudgate.yaml").string()}).code, 4);
  }
  io->Signal(SIGKILL);
  ASSERT_TRUE(Eventually([&] {
    const Samples samples = Parse(watch->Output());
    return samples.at("io-1 input_5").value("quality", -1) == 0x08;
  }));
  EXPECT_THAT(watch->Output(), Not(HasSubstr("\"gone\"")));
}

}  // namespace
}  // namespace baudgate::system_test
