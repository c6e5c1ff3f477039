// What a file of QoS profiles may not say, one sentence each.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/profile_check.h"

#include <gtest/gtest.h>

namespace baudgate::dds {
namespace {

std::string Participant(const std::string& inside) {
  return "<profiles>\n<participant profile_name=\"baudgate\">\n" + inside +
         "\n</participant></profiles>";
}
std::string WriterProfile(const std::string& inside) {
  return "<dds><profiles>\n<data_writer profile_name=\"baudgate/points\">\n" + inside +
         "\n</data_writer></profiles></dds>";
}

std::string ErrorOf(const std::string& text) {
  const auto found = CheckProfiles("/f.xml", text);
  return found ? "" : found.error();
}

TEST(ProfileCheck, FindsItsOwn) {
  const auto participant = CheckProfiles("/f.xml", Participant("<rtps><name>x</name></rtps>"));
  ASSERT_TRUE(participant.ok()) << participant.error();
  EXPECT_TRUE(participant->participant);
  EXPECT_TRUE(participant->writers.empty());
  const auto writer = CheckProfiles(
      "/f.xml", WriterProfile("<qos><reliability><kind> RELIABLE </kind></reliability></qos>"
                              "<times><heartbeatPeriod><sec>1</sec></heartbeatPeriod></times>"));
  ASSERT_TRUE(writer.ok()) << writer.error();
  EXPECT_FALSE(writer->participant);
  EXPECT_EQ(writer->writers, std::set<std::string>{"baudgate/points"});
}

TEST(ProfileCheck, OneSentenceEach) {
  const struct {
    std::string text;
    const char* sentence;
  } kCases[] = {
      {"<profiles>\n<participant", "/f.xml:2: is not XML (XML_ERROR_PARSING_ELEMENT)"},
      {"", "/f.xml:0: is not XML (XML_ERROR_EMPTY_DOCUMENT)"},
      {"<profiles><participant profile_name=\"other\"/></profiles>",
       "/f.xml: has none of the profiles baudgate, baudgate/points, baudgate/devices, "
       "baudgate/gateways; remove dds.profiles or name one so"},
      {WriterProfile("<qos><reliability>\n<kind>BEST_EFFORT</kind></reliability></qos>"),
       "/f.xml:4: data_writer baudgate/points: qos/reliability/kind is BEST_EFFORT, not RELIABLE: "
       "subscribers ask for no less; remove it"},
      {WriterProfile("<topic><historyQos><depth>2</depth></historyQos></topic>"),
       "/f.xml:3: data_writer baudgate/points: topic/historyQos/depth is 2, not 1: the latest "
       "sample of a point is kept; remove it"},
      {WriterProfile("<qos><deadline/></qos>"),
       "/f.xml:3: data_writer baudgate/points: qos/deadline can not be set: it makes each sample "
       "as slow as all points together; remove it"},
      {Participant("<rtps><userTransports/></rtps>"),
       "/f.xml:3: participant baudgate: rtps/userTransports can not be set: these are not checked; "
       "see dds.interfaces; remove it"},
      {Participant("<rtps><builtin><discovery_config><leaseDuration/></discovery_config></builtin>"
                   "</rtps>"),
       "/f.xml:3: participant baudgate: rtps/builtin/discovery_config/leaseDuration can not be "
       "set: it is 3 s: subscribers rely on seeing a crash by then; remove it"},
      {"<profiles><participant profile_name=\"baudgate\" domain_id=\"1\"/></profiles>",
       "/f.xml:1: participant baudgate: domain_id: the domain is dds.domain; remove it"},
      {"<profiles><participant profile_name=\"baudgate\"/>\n"
       "<participant profile_name=\"baudgate\"/></profiles>",
       "/f.xml:2: profile baudgate stands twice"},
      {"<dds><log/><profiles><participant profile_name=\"baudgate\"/></profiles></dds>",
       "/f.xml:1: log: it would hold for the whole process; remove it"},
  };
  for (const auto& one : kCases) {
    EXPECT_EQ(ErrorOf(one.text), std::string("dds: profiles: ") + one.sentence);
  }
}

/// Whatever stands in profiles for other programs.
TEST(ProfileCheck, OthersAreNotLookedAt) {
  EXPECT_EQ(ErrorOf("<profiles><participant profile_name=\"baudgate\"/>"
                    "<participant profile_name=\"other\"><rtps><userTransports/></rtps>"
                    "</participant><data_reader profile_name=\"baudgate/points\"><qos><reliability>"
                    "<kind>BEST_EFFORT</kind></reliability></qos></data_reader></profiles>"),
            "");
}

}  // namespace
}  // namespace baudgate::dds
