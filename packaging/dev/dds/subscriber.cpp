// A subscriber of baudgate on Fast DDS 2: prints every point, and again when it changes. Its types
// are generated from the IDL (CMakeLists.txt); settings of the network come from
// FASTRTPS_DEFAULT_PROFILES_FILE (fastdds.xml).
//   fast_subscriber [domain]
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <thread>

#include "baudgatePubSubTypes.h"

using namespace eprosima::fastdds::dds;
using Point = baudgate::v1::PointSample;

FASTDDS_SEQUENCE(Points, Point);

constexpr int kMostPoints = 100000;

int main(int argc, char** argv) {
  auto* factory = DomainParticipantFactory::get_instance();
  factory->load_profiles();
  DomainParticipantQos participant_qos = factory->get_default_participant_qos();
  auto* participant = factory->create_participant(
      static_cast<DomainId_t>(argc > 1 ? std::atoi(argv[1]) : 0), participant_qos);
  if (participant == nullptr) {
    std::fprintf(stderr, "fast_subscriber: no participant\n");
    return 1;
  }
  TypeSupport type(new baudgate::v1::PointSamplePubSubType());
  // Cyclone DDS drops readers that announce this description of their type, and nobody here
  // reads it.
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  type.register_type(participant);
  auto* topic =
      participant->create_topic("baudgate/points", type.get_type_name(), TOPIC_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);

  DataReaderQos qos = DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  // 10 instances unless it is raised: the eleventh point would be dropped without a word.
  qos.resource_limits().max_instances = kMostPoints;
  qos.resource_limits().max_samples = kMostPoints;
  qos.resource_limits().max_samples_per_instance = 1;
  qos.reader_resource_limits().max_samples_per_read = 4000;
  auto* reader = subscriber->create_datareader(topic, qos);
  if (reader == nullptr) return 1;

  // At most twenty times a second: what has changed meanwhile is kept, the latest of each point.
  for (;;) {
    reader->wait_for_unread_message({60, 0});
    Points samples;
    SampleInfoSeq infos;
    while (reader->take(samples, infos, 4000) == ReturnCode_t::RETCODE_OK) {
      for (LoanableCollection::size_type i = 0; i < infos.length(); ++i) {
        const Point& s = samples[i];
        if (!infos[i].valid_data) continue;  // its gateway has left
        if ((s.quality() & 0xC0) != 0xC0) {  // an OPC quality; its high byte says why
          std::printf("%s %s %s: not good, quality 0x%04X\n", s.gateway().c_str(),
                      s.device().c_str(), s.point().c_str(), s.quality());
        } else if (s.text().size() != 0) {
          std::printf("%s %s %s = %s %s\n", s.gateway().c_str(), s.device().c_str(),
                      s.point().c_str(), s.text().c_str(), s.unit().c_str());
        } else {
          std::printf("%s %s %s = %.9g %s\n", s.gateway().c_str(), s.device().c_str(),
                      s.point().c_str(), s.value(), s.unit().c_str());
        }
      }
      reader->return_loan(samples, infos);
    }
    std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}
