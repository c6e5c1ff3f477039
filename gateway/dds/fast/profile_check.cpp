// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/profile_check.h"

#include <tinyxml2.h>

#include <span>
#include <string_view>

namespace baudgate::dds {
namespace {

using tinyxml2::XMLElement;

/// An element below a profile, "qos/reliability/kind".
struct Rule {
  const char* path;
  const char* allowed;  ///< the only text; null: it may not be there at all
  const char* instead;
};

constexpr Rule kParticipantRules[] = {
    {"domainId", nullptr, "the domain is dds.domain"},
    {"rtps/prefix", nullptr, "two participants of one prefix are taken for one"},
    {"rtps/useBuiltinTransports", "false", "these are not checked; see dds.interfaces"},
    {"rtps/userTransports", nullptr, "these are not checked; see dds.interfaces"},
    {"rtps/propertiesPolicy", nullptr, "security and statistics are not set by profiles"},
    {"rtps/allocation", nullptr, "the bounds hold off whoever would fill the memory"},
    {"rtps/builtin/initialPeersList", nullptr, "these are dds.peers"},
    {"rtps/builtin/typelookup_config", nullptr, "other vendors drop what announces it"},
    {"rtps/builtin/discovery_config/discoveryProtocol", nullptr, "the gateway's own is kept"},
    {"rtps/builtin/discovery_config/discoveryServersList", nullptr, "the gateway asks none"},
    {"rtps/builtin/discovery_config/EDP", "SIMPLE", "nobody would find the topics"},
    {"rtps/builtin/discovery_config/static_edp_xml_config", nullptr,
     "nobody would find the topics"},
    {"rtps/builtin/discovery_config/leaseDuration", nullptr,
     "it is 3 s: subscribers rely on seeing a crash by then"},
    {"rtps/builtin/discovery_config/leaseAnnouncement", nullptr, "it goes with the lease of 3 s"},
};

constexpr Rule kWriterRules[] = {
    {"qos/reliability/kind", "RELIABLE", "subscribers ask for no less"},
    {"qos/durability/kind", "TRANSIENT_LOCAL", "late subscribers get the latest samples"},
    {"topic/historyQos/kind", "KEEP_LAST", "the latest sample of a point is kept"},
    {"topic/historyQos/depth", "1", "the latest sample of a point is kept"},
    {"topic/resourceLimitsQos", nullptr, "these are counted from the points"},
    {"qos/deadline", nullptr, "it makes each sample as slow as all points together"},
    {"qos/lifespan", nullptr, "late subscribers get the latest samples"},
    {"qos/partition", nullptr, "the key names the gateway"},
    {"qos/ownership/kind", "SHARED", "subscribers would not match"},
    {"qos/liveliness/kind", "AUTOMATIC", "nobody asserts another one"},
    {"qos/data_sharing", nullptr, "see dds.shared_memory"},
    {"qos/disablePositiveAcks", nullptr, "samples would be lost"},
    {"qos/representation", nullptr, "the wire form is fixed by the IDL"},
    {"entityID", nullptr, "a topic may have several writers"},
    {"userDefinedID", nullptr, "a topic may have several writers"},
};

constexpr const char* kTopics[] = {"baudgate/points", "baudgate/devices", "baudgate/gateways"};

const XMLElement* Find(const XMLElement& from, std::string_view path) {
  const XMLElement* at = &from;
  while (at != nullptr && !path.empty()) {
    const auto slash = path.find('/');
    at = at->FirstChildElement(std::string(path.substr(0, slash)).c_str());
    path = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
  }
  return at;
}

/// Without what surrounds it.
std::string TextOf(const XMLElement& element) {
  const char* raw = element.GetText();
  const std::string_view text = raw == nullptr ? "" : raw;
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1));
}

class ProfileCheck {
 public:
  explicit ProfileCheck(const std::string& file) : file_(file) {}

  Status Walk(const XMLElement& element, int depth) {
    const std::string name = element.Name();
    const char* attribute = element.Attribute("profile_name");
    const std::string profile = attribute == nullptr ? "" : attribute;
    if (name == "log" || name == "library_settings") {
      return At(element, name + ": it would hold for the whole process; remove it");
    }
    if (name == "participant" && profile == kParticipantProfile) {
      if (std::exchange(found_.participant, true)) return Twice(element, profile);
      if (element.Attribute("domain_id") != nullptr) {
        return At(element, "participant baudgate: domain_id: the domain is dds.domain; remove it");
      }
      return Judge(element, profile, kParticipantRules);
    }
    for (const char* topic : kTopics) {
      if ((name != "data_writer" && name != "publisher") || profile != topic) continue;
      if (!found_.writers.insert(profile).second) return Twice(element, profile);
      return Judge(element, profile, kWriterRules);
    }
    if (depth == 0) return {};
    for (const XMLElement* child = element.FirstChildElement(); child != nullptr;
         child = child->NextSiblingElement()) {
      if (const Status status = Walk(*child, depth - 1); !status) return status;
    }
    return {};
  }

  const OwnProfiles& found() const { return found_; }

 private:
  Status At(const XMLElement& element, const std::string& what) const {
    return Error{"dds: profiles: " + file_ + ":" + std::to_string(element.GetLineNum()) + ": " +
                 what};
  }
  Status Twice(const XMLElement& element, const std::string& profile) const {
    return At(element, "profile " + profile + " stands twice");
  }
  Status Judge(const XMLElement& profile, const std::string& name, std::span<const Rule> rules) {
    for (const Rule& rule : rules) {
      const XMLElement* const element = Find(profile, rule.path);
      if (element == nullptr) continue;
      const std::string text = TextOf(*element);
      if (rule.allowed != nullptr && text == rule.allowed) continue;
      const std::string where = std::string(profile.Name()) + " " + name + ": " + rule.path;
      if (rule.allowed == nullptr) {
        return At(*element, where + " can not be set: " + rule.instead + "; remove it");
      }
      return At(*element, where + " is " + text + ", not " + rule.allowed + ": " + rule.instead +
                              "; remove it");
    }
    return {};
  }

  const std::string& file_;
  OwnProfiles found_;
};

constexpr int kDepthOfProfiles = 3;  // dds, profiles, the profile

}  // namespace

Result<OwnProfiles> CheckProfiles(const std::string& file, const std::string& text) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    return Error{"dds: profiles: " + file + ":" + std::to_string(document.ErrorLineNum()) +
                 ": is not XML (" + document.ErrorName() + ")"};
  }
  ProfileCheck check(file);
  if (const Status status = check.Walk(*document.RootElement(), kDepthOfProfiles); !status) {
    return Error{status.error()};
  }
  const OwnProfiles& found = check.found();
  if (!found.participant && found.writers.empty()) {
    return Error{"dds: profiles: " + file +
                 ": has none of the profiles baudgate, baudgate/points, baudgate/devices, "
                 "baudgate/gateways; remove dds.profiles or name one so"};
  }
  return found;
}

}  // namespace baudgate::dds
