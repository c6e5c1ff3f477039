// Tests of the messages for Home Assistant.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/discovery.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/gateway/outputs/mqtt/fixture.h"

namespace baudgate::mqtt {
namespace {

class DiscoveryTest : public ::testing::Test {
 protected:
  std::optional<Entity> Of(const config::Point& point) const {
    return EntityOf(config_.mqtt, Topics(config_), config_.name, config_.lines[0],
                    config_.lines[0].devices[0], point);
  }

  config::Config config_ = testing::GatewayConfig();
  const std::vector<config::Point> points_ = config_.lines[0].devices[0].points;
};

TEST_F(DiscoveryTest, APointIsASensorNumberSwitchOrButton) {
  using config::Access;
  using config::Type;
  const struct {
    Type type;
    Access access;
    bool allowed;
    bool select;
    std::string component;  ///< empty: none
  } kCases[] = {
      {Type::float32, Access::read, false, false, "sensor"},
      {Type::string, Access::read_write, true, false, "sensor"},
      {Type::boolean, Access::read, false, false, "binary_sensor"},
      {Type::uint16, Access::read_write, true, false, "number"},
      {Type::uint16, Access::read_write, false, false, "sensor"},
      {Type::boolean, Access::read_write, true, false, "switch"},
      {Type::boolean, Access::read_write, true, true, "binary_sensor"},
      {Type::boolean, Access::write, true, false, "button"},
      {Type::boolean, Access::write, true, true, ""},
      {Type::uint16, Access::write, true, false, ""},
  };
  for (const auto& [type, access, allowed, select, component] : kCases) {
    config::Point point;
    point.name = "p";
    point.type = type;
    point.access = access;
    point.writing.allowed = allowed;
    point.writing.select = select;
    const auto entity = Of(point);
    ASSERT_EQ(entity.has_value(), !component.empty()) << component;
    if (!entity) continue;
    EXPECT_EQ(entity->topic, "homeassistant/" + component + "/gate/feeder--p/config");
    const auto json = nlohmann::json::parse(entity->payload);
    const bool commands = component == "number" || component == "switch" || component == "button";
    EXPECT_EQ(json.contains("command_topic"), commands) << component;
  }
  config_.mqtt.commands = false;
  EXPECT_THAT(Of(points_[1])->topic, ::testing::HasSubstr("/sensor/"));
}

TEST_F(DiscoveryTest, AnEntityIsAvailableWhileTheGatewayIsOnlineAndTheValueIsGood) {
  const auto json = nlohmann::json::parse(Of(points_[0])->payload);
  EXPECT_EQ(json["state_topic"], "baudgate/gate/bay/feeder/current");
  EXPECT_EQ(json["device_class"], "current");
  EXPECT_EQ(json["unit_of_measurement"], "A");
  EXPECT_EQ(json["state_class"], "measurement");
  EXPECT_EQ(json["availability_mode"], "all");
  EXPECT_EQ(json["availability"][0]["topic"], "baudgate/gate/status");
  EXPECT_EQ(json["availability"][1]["topic"], "baudgate/gate/bay/feeder/current");
  EXPECT_EQ(json["availability"][1]["value_template"],
            "{{ 'online' if value_json.quality == 'good' else 'offline' }}");
  EXPECT_EQ(json["value_template"], "{{ value_json.value }}");
  const auto number = nlohmann::json::parse(Of(points_[1])->payload);
  EXPECT_EQ(number["min"], 0);
  EXPECT_EQ(number["max"], 40);
  EXPECT_EQ(number["command_topic"], "baudgate/gate/bay/feeder/setting/set");
  config_.mqtt.payload = config::Mqtt::Payload::value;
  EXPECT_EQ(nlohmann::json::parse(Of(points_[0])->payload)["value_template"], "{{ value }}");
}

TEST_F(DiscoveryTest, EnergyIsACounter) {
  for (const auto& [unit, shown, kind] :
       {std::tuple("kWh", "kWh", "energy"), std::tuple("degC", "°C", "temperature")}) {
    const auto json = nlohmann::json::parse(
        Of(testing::PointNamed("p", config::Type::float32, false, unit))->payload);
    EXPECT_EQ(json["unit_of_measurement"], shown);
    EXPECT_EQ(json["device_class"], kind);
    EXPECT_EQ(json["state_class"], unit == std::string("kWh") ? "total_increasing" : "measurement");
  }
}

}  // namespace
}  // namespace baudgate::mqtt
