// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/demo_documents.h"

#include <initializer_list>

namespace baudgate::pki {
namespace {

std::string Head(const std::string& schema) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"\n"
         "     xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-SECURITY/20170901/" +
         schema + "\">\n";
}

/// Cyclone DDS takes no higher number.
constexpr char kAllDomains[] =
    "      <domains>\n"
    "        <id_range><min>0</min><max>230</max></id_range>\n"
    "      </domains>\n";

std::string Topics(const std::string& tag, std::initializer_list<const char*> topics) {
  std::string text = "        <" + tag + ">\n          <topics>";
  for (const char* topic : topics) text += std::string("<topic>") + topic + "</topic>";
  return text + "</topics>\n        </" + tag + ">\n";
}

/// A gateway publishes no requests: its key commands no other gateway.
std::string Rights(Part part) {
  if (part == Part::publish) {
    return Topics("publish", {"baudgate/[!w]*", "baudgate/write_reply"}) +
           Topics("subscribe", {"baudgate/write"});
  }
  const std::string subscribe = Topics("subscribe", {"baudgate/*"});
  return part == Part::write ? Topics("publish", {"baudgate/write"}) + subscribe : subscribe;
}

/// 2026-11-22T20:00:00, which is UTC.
std::string Time(WallTime time) { return FormatWallTime(time).substr(0, 19); }

}  // namespace

std::string Governance() {
  return Head("omg_shared_ca_governance.xsd") +
         "  <domain_access_rules>\n"
         "    <domain_rule>\n" +
         kAllDomains +
         "      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
         "      <enable_join_access_control>true</enable_join_access_control>\n"
         "      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>\n"
         "      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>\n"
         "      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>\n"
         "      <topic_access_rules>\n"
         "        <topic_rule>\n"
         "          <topic_expression>baudgate/*</topic_expression>\n"
         "          <enable_discovery_protection>true</enable_discovery_protection>\n"
         "          <enable_liveliness_protection>true</enable_liveliness_protection>\n"
         "          <enable_read_access_control>true</enable_read_access_control>\n"
         "          <enable_write_access_control>true</enable_write_access_control>\n"
         "          <metadata_protection_kind>NONE</metadata_protection_kind>\n"
         "          <data_protection_kind>ENCRYPT</data_protection_kind>\n"
         "        </topic_rule>\n"
         "      </topic_access_rules>\n"
         "    </domain_rule>\n"
         "  </domain_access_rules>\n"
         "</dds>\n";
}

std::string Permissions(const std::string& name, Part part, WallTime from, WallTime until) {
  return Head("omg_shared_ca_permissions.xsd") + "  <permissions>\n    <grant name=\"" + name +
         "\">\n      <subject_name>CN=" + name +
         "</subject_name>\n"
         "      <validity>\n        <not_before>" +
         Time(from) + "</not_before>\n        <not_after>" + Time(until) +
         "</not_after>\n      </validity>\n"
         "      <allow_rule>\n" +
         kAllDomains + Rights(part) +
         "      </allow_rule>\n"
         "      <default>DENY</default>\n"
         "    </grant>\n"
         "  </permissions>\n"
         "</dds>\n";
}

}  // namespace baudgate::pki
