// `EntityOf` returns the message by which Home Assistant discovers a point
// (https://www.home-assistant.io/integrations/mqtt/#mqtt-discovery). An entity is available while
// the gateway is online and the quality of the point is good.
//
//   number, text, bool that is read             sensor, binary_sensor
//   number, bool that may also be written       number, switch
//   bool that is only written                   button
//   a point that must be selected before        as if it were only read: one touch of a screen must
//   a write (`select: true`)                    not operate it
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/model/config.h"
#include "gateway/outputs/mqtt/messages.h"

namespace baudgate::mqtt {

struct Entity {
  std::string topic;
  std::string payload;
};

/// Nothing: the point has no entity. `settings`: `commands` false makes all points read-only.
std::optional<Entity> EntityOf(const config::Mqtt& settings, const Topics& topics,
                               const std::string& gateway, const config::Line& line,
                               const config::Device& device, const config::Point& point);

/// Returns the filter of the topics of all entities of the gateway.
std::string EntityFilter(const std::string& gateway);
bool IsEntityTopic(const std::string& topic);
/// Returns the begin of the ids of all entities of the gateway, which is in each of their messages.
std::string EntityId(const std::string& gateway);

}  // namespace baudgate::mqtt
