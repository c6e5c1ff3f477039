// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/qos_profiles.h"

#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <cerrno>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fstream>
#include <mutex>

#include "gateway/dds/fast/profile_check.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr std::size_t kMostBytes = 1U << 20;

std::mutex profiles_mutex;
OwnProfiles loaded;  // of the library, which has one set of profiles for the process

Result<std::string> ReadFile(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    return Error{"dds: profiles: " + file + " can not be read: " + std::strerror(errno)};
  }
  std::string text(kMostBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad() || stream.gcount() == 0) {
    return Error{"dds: profiles: " + file + " is empty or can not be read"};
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMostBytes) return Error{"dds: profiles: " + file + " is longer than 1 MiB"};
  return text;
}

}  // namespace

Status LoadProfiles(const std::string& file, fast::DomainParticipantQos& qos) {
  const std::lock_guard lock(profiles_mutex);
  loaded = {};
  if (file.empty()) return {};
  const auto text = ReadFile(file);
  if (!text) return Error{text.error()};
  const auto found = CheckProfiles(file, *text);
  if (!found) return Error{found.error()};
  // A name that is there already would be refused.
  eprosima::fastrtps::xmlparser::XMLProfileManager::DeleteInstance();
  auto* const factory = fast::DomainParticipantFactory::get_instance();
  const Error damaged{"dds: profiles: " + file +
                      " is not understood by Fast DDS; what it can not use stands above in the "
                      "log"};
  if (factory->load_XML_profiles_string(text->data(), text->size()) != ReturnCode_t::RETCODE_OK) {
    return damaged;
  }
  if (found->participant && factory->get_participant_qos_from_profile(kParticipantProfile, qos) !=
                                ReturnCode_t::RETCODE_OK) {
    return damaged;
  }
  loaded = *found;
  return {};
}

void UseProfile(const fast::Publisher& publisher, const char* topic, fast::DataWriterQos& qos) {
  const std::lock_guard lock(profiles_mutex);
  if (loaded.writers.contains(topic)) publisher.get_datawriter_qos_from_profile(topic, qos);
}

}  // namespace baudgate::dds
