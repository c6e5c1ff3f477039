// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/types.h"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastrtps/types/AnnotationParameterValue.h>
#include <fastrtps/types/TypeObjectFactory.h>
#include <fastrtps/utils/md5.h>

#include <algorithm>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::dds {
namespace {

/// Returns the size in bytes of the longest possible key: each text has its longest length, a
/// length field and padding.
template <typename Sample>
constexpr std::size_t LongestKey() {
  std::size_t bytes = 0;
  ForEachField<Sample>([&bytes](const auto& field) {
    if (field.key) bytes += 4 + field.bound + 1 + 3;
  });
  return bytes;
}

}  // namespace

template <typename Sample>
KeyHash HashKey(const Sample& sample) {
  std::array<std::uint8_t, LongestKey<Sample>()> key{};
  std::size_t used = 0;
  ForEachField<Sample>([&]<typename Value>(const Field<Sample, Value>& field) {
    if constexpr (std::is_same_v<Value, std::string>) {
      if (!field.key) return;
      const std::string_view text = std::string_view(sample.*field.member).substr(0, field.bound);
      used = (used + 3) / 4 * 4;
      const auto length = static_cast<std::uint32_t>(text.size() + 1);
      for (const unsigned shift : {24U, 16U, 8U, 0U}) {
        key[used++] = static_cast<std::uint8_t>(length >> shift);
      }
      std::copy(text.begin(), text.end(), key.begin() + static_cast<std::ptrdiff_t>(used));
      used += text.size();
      key[used++] = 0;
    }
  });
  ::MD5 md5;
  md5.init();
  md5.update(key.data(), static_cast<unsigned int>(used));
  md5.finalize();
  KeyHash hash;
  std::copy(std::begin(md5.digest), std::end(md5.digest), hash.begin());
  return hash;
}

template KeyHash HashKey(const PointSample& sample);
template KeyHash HashKey(const DeviceSample& sample);
template KeyHash HashKey(const GatewaySample& sample);
template KeyHash HashKey(const EventSample& sample);
template KeyHash HashKey(const AlarmSample& sample);
template KeyHash HashKey(const RequestSample& sample);
template KeyHash HashKey(const ReplySample& sample);

namespace {

using eprosima::fastdds::dds::TopicDataType;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using namespace eprosima::fastrtps::types;

TypeObjectFactory& Factory() { return *TypeObjectFactory::get_instance(); }

const TypeIdentifier& IdentifierOf(const TypeField& field) {
  switch (field.kind) {
    case TypeField::Kind::text:
      return *Factory().get_string_identifier(field.bound, false);
    case TypeField::Kind::boolean:
      return *Factory().get_type_identifier("bool", false);
    case TypeField::Kind::float64:
      return *Factory().get_type_identifier("double", false);
    case TypeField::Kind::uint16:
      return *Factory().get_type_identifier("uint16_t", false);
    case TypeField::Kind::uint32:
      return *Factory().get_type_identifier("uint32_t", false);
    case TypeField::Kind::int64:
      return *Factory().get_type_identifier("int64_t", false);
    case TypeField::Kind::uint64:
      return *Factory().get_type_identifier("uint64_t", false);
  }
  return *Factory().get_type_identifier("double", false);
}

NameHash HashOf(const std::string& name) {
  const MD5 md5(name);
  NameHash hash;
  std::copy_n(md5.digest, hash.size(), hash.begin());
  return hash;
}

template <typename Member>
Member MemberOf(const TypeField& field, MemberId id) {
  Member member;
  member.common().member_id(id);
  member.common().member_flags().IS_KEY(field.key);
  member.common().member_type_id(IdentifierOf(field));
  return member;
}

/// Returns the annotation "@key": generic readers look for this annotation and not for the flag
/// IS_KEY.
AppliedAnnotation KeyAnnotation() {
  AnnotationParameterValue yes;
  yes._d(TK_BOOLEAN);
  yes.from_string("true");
  AppliedAnnotationParameter parameter;
  parameter.paramname_hash() = HashOf("value");
  parameter.value(yes);
  AppliedAnnotation key;
  key.annotation_typeid(*Factory().get_type_identifier_trying_complete("key"));
  key.param_seq().push_back(parameter);
  return key;
}

TypeObject Minimal(const TypeDescription& type) {
  TypeObject object;
  object._d(EK_MINIMAL);
  object.minimal()._d(TK_STRUCTURE);
  MinimalStructType& made = object.minimal().struct_type();
  made.struct_flags().IS_FINAL(true);
  for (const TypeField& field : type.fields) {
    auto member =
        MemberOf<MinimalStructMember>(field, static_cast<MemberId>(made.member_seq().size()));
    member.detail().name_hash() = HashOf(std::string(field.name));
    made.member_seq().push_back(member);
  }
  return object;
}

TypeObject Complete(const TypeDescription& type) {
  TypeObject object;
  object._d(EK_COMPLETE);
  object.complete()._d(TK_STRUCTURE);
  CompleteStructType& made = object.complete().struct_type();
  made.struct_flags().IS_FINAL(true);
  made.header().detail().type_name(std::string(type.name));
  for (const TypeField& field : type.fields) {
    auto member =
        MemberOf<CompleteStructMember>(field, static_cast<MemberId>(made.member_seq().size()));
    member.detail().name(std::string(field.name));
    if (field.key) member.detail().ann_custom().push_back(KeyAnnotation());
    made.member_seq().push_back(member);
  }
  return object;
}

/// The identifier contains the first 14 bytes of the MD5 of the serialized object (XTypes 1.2,
/// 7.3.4.2).
TypeIdentifier IdentifierOf(const TypeObject& object, EquivalenceKind kind) {
  std::vector<char> bytes(TypeObject::getCdrSerializedSize(object) + 4);
  eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
  eprosima::fastcdr::Cdr cdr(buffer, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS,
                             eprosima::fastcdr::Cdr::DDS_CDR);
  object.serialize(cdr);
  MD5 md5;
  md5.update(bytes.data(), static_cast<MD5::size_type>(cdr.getSerializedDataLength()));
  md5.finalize();
  TypeIdentifier identifier;
  identifier._d(kind);
  std::copy_n(md5.digest, 14, identifier.equivalence_hash());
  return identifier;
}

/// Registers the type as an XTypes TypeObject of version 1, with which generic tools on Fast DDS 2
/// can decode samples. To be called before the type is registered with a participant.
/// TypeInformation must not be used: Fast DDS 2.9 writes it in a form for which Cyclone DDS drops
/// the endpoint.
void DescribeType(const TypeDescription& type) {
  const std::string name = "baudgate::v1::" + std::string(type.name);
  const TypeObject complete = Complete(type);
  const TypeObject minimal = Minimal(type);
  const TypeIdentifier complete_id = IdentifierOf(complete, EK_COMPLETE);
  const TypeIdentifier minimal_id = IdentifierOf(minimal, EK_MINIMAL);
  Factory().add_type_object(name, &complete_id, &complete);
  Factory().add_type_object(name, &minimal_id, &minimal);
}

// The type support is not generated by fastddsgen, because its code cuts long texts silently, and
// terminates a subscriber that gets a sample with an unknown encapsulation.
template <typename Sample>
class SampleType : public TopicDataType {
 public:
  SampleType() {
    setName(("baudgate::v1::" + std::string(kTypeOf<Sample>.name)).c_str());
    m_typeSize = static_cast<std::uint32_t>(kMaxBytes<Sample>);
    m_isGetKeyDefined = true;
    DescribeType(kTypeOf<Sample>);
    auto_fill_type_information(false);
    auto_fill_type_object(true);
  }

  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto length = Encode(*static_cast<Sample*>(data), {payload->data, payload->max_size});
    if (length == 0) return false;
    payload->length = static_cast<std::uint32_t>(length);
    payload->encapsulation = CDR_LE;
    return true;
  }

  bool deserialize(SerializedPayload_t* payload, void* data) override {
    auto& sample = *static_cast<Sample*>(data);
    if (Decode({payload->data, payload->length}, sample)) return true;
    // A take of several samples returns this sample although it could not be decoded (Fast DDS
    // 2.9). An empty `gateway` marks it, so that gateway/outputs/dds/fast/inbox.h drops it.
    sample = Sample{};
    return false;
  }

  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return static_cast<std::uint32_t>(kMaxBytes<Sample>); };
  }

  void* createData() override { return new Sample; }
  void deleteData(void* data) override { delete static_cast<Sample*>(data); }

  bool getKey(void* data, InstanceHandle_t* handle, bool) override {
    const KeyHash hash = HashKey(*static_cast<Sample*>(data));
    for (std::size_t i = 0; i < hash.size(); ++i) handle->value[i] = hash[i];
    return true;
  }
};

}  // namespace

TopicDataType* NewPointType() { return new SampleType<PointSample>(); }
TopicDataType* NewDeviceType() { return new SampleType<DeviceSample>(); }
TopicDataType* NewGatewayType() { return new SampleType<GatewaySample>(); }
TopicDataType* NewEventType() { return new SampleType<EventSample>(); }
TopicDataType* NewAlarmType() { return new SampleType<AlarmSample>(); }
TopicDataType* NewRequestType() { return new SampleType<RequestSample>(); }
TopicDataType* NewReplyType() { return new SampleType<ReplySample>(); }

}  // namespace baudgate::dds
