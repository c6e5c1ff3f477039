// Files of XML QoS profiles, given to Fast DDS: what they say counts, a second file replaces the
// first, and what the gateway promises holds above both.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/qos_profiles.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <filesystem>
#include <fstream>
#include <memory>

#include "gateway/dds/fast/participant.h"
#include "gateway/dds/samples.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

class QosProfilesTest : public ::testing::Test {
 protected:
  QosProfilesTest() { std::filesystem::create_directory(directory_); }
  ~QosProfilesTest() override { std::filesystem::remove_all(directory_); }

  /// A file with a name for the participant and a heartbeat, in seconds, for the writer of points.
  std::string File(const std::string& name, int heartbeat) const {
    const std::string path = directory_ + "/" + name + ".xml";
    std::ofstream(path) << "<dds xmlns=\"http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles\">"
                           "<profiles><participant profile_name=\"baudgate\"><rtps><name>"
                        << name
                        << "</name></rtps></participant>"
                           "<data_writer profile_name=\"baudgate/points\"><times><heartbeatPeriod>"
                           "<sec>"
                        << heartbeat
                        << "</sec></heartbeatPeriod></times></data_writer></profiles></dds>";
    return path;
  }

  /// The name of a participant made with this file, and the heartbeat of a writer of points.
  void Expect(const std::string& file, const std::string& name, int heartbeat) {
    ParticipantOptions options;
    options.domain = 100 + static_cast<int>(::getpid() % 100);
    options.interfaces = {"127.0.0.1"};
    options.profiles = file;
    const auto made = CreateParticipant(options);
    ASSERT_TRUE(made.ok()) << made.error();
    const std::unique_ptr<fast::DomainParticipant, decltype(&DeleteParticipant)> participant(
        *made, &DeleteParticipant);
    EXPECT_EQ(participant->get_qos().name().to_string(), name);
    EXPECT_EQ(participant->get_qos().wire_protocol().builtin.discovery_config.leaseDuration.seconds,
              3);
    auto* const publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    ASSERT_NE(publisher, nullptr);
    fast::DataWriterQos qos;
    UseProfile(*publisher, kPointTopic, qos);
    EXPECT_EQ(qos.reliable_writer_qos().times.heartbeatPeriod.seconds, heartbeat);
  }

  const std::string directory_ =
      (std::filesystem::temp_directory_path() / ("profiles-" + std::to_string(::getpid())))
          .string();
};

TEST_F(QosProfilesTest, TheLastFileCounts) {
  Expect(File("first", 7), "first", 7);
  Expect(File("second", 9), "second", 9);
  const fast::DataWriterQos fresh;
  Expect("", "baudgate", fresh.reliable_writer_qos().times.heartbeatPeriod.seconds);
}

TEST_F(QosProfilesTest, WithoutItsFileThereIsNoParticipant) {
  ParticipantOptions options;
  options.interfaces = {"127.0.0.1"};
  options.profiles = directory_ + "/none.xml";
  const auto made = CreateParticipant(options);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error(),
            "dds: profiles: " + options.profiles + " can not be read: No such file or directory");
}

}  // namespace
}  // namespace baudgate::dds
