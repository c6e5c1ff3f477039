// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/type_objects.h"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastrtps/types/AnnotationParameterValue.h>
#include <fastrtps/types/TypeObjectFactory.h>
#include <fastrtps/utils/md5.h>

#include <algorithm>
#include <string>
#include <vector>

namespace baudgate::dds {
namespace {

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

/// XTypes 1.2, 7.3.4.5: the first four bytes of the MD5 of the name.
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

/// "@key": generic readers look for the annotation, not for the flag.
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

/// XTypes 1.2, 7.3.4.2: the first 14 bytes of the MD5 of the serialized object.
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

}  // namespace

void DescribeType(const TypeDescription& type) {
  const std::string name = "baudgate::v1::" + std::string(type.name);
  const TypeObject complete = Complete(type);
  const TypeObject minimal = Minimal(type);
  const TypeIdentifier complete_id = IdentifierOf(complete, EK_COMPLETE);
  const TypeIdentifier minimal_id = IdentifierOf(minimal, EK_MINIMAL);
  Factory().add_type_object(name, &complete_id, &complete);
  Factory().add_type_object(name, &minimal_id, &minimal);
}

}  // namespace baudgate::dds
