// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/any_fields.h"

#include <fastrtps/types/DynamicType.h>
#include <fastrtps/types/DynamicTypeMember.h>
#include <fastrtps/types/MemberDescriptor.h>
#include <fastrtps/types/TypeDescriptor.h>
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <optional>

namespace baudgate::dds {
namespace {

using namespace eprosima::fastrtps::types;

constexpr std::size_t kMostFields = 1000;
constexpr int kDeepest = 16;

/// `get`: one of the getters of DynamicData.
template <typename Value>
std::optional<Value> Got(DynamicData& data, MemberId id,
                         ReturnCode_t (DynamicData::*get)(Value&, MemberId) const) {
  Value value{};
  if ((data.*get)(value, id) != ReturnCode_t::RETCODE_OK) return std::nullopt;
  return value;
}

template <typename Value>
AnyField Number(std::optional<Value> value) {
  if (!value) return {{}, "unreadable", AnyField::Form::none};
  if constexpr (std::is_floating_point_v<Value>) {
    if (!std::isfinite(*value)) return {{}, fmt::format("{}", *value), AnyField::Form::none};
  }
  return {{}, fmt::format("{}", *value), AnyField::Form::number};
}

AnyField Text(const std::optional<std::string>& value) {
  if (!value) return {{}, "unreadable", AnyField::Form::none};
  return {{}, *value, AnyField::Form::text};
}

/// Empty: it holds others.
std::optional<AnyField> Plain(DynamicData& data, MemberId id, TypeKind kind) {
  switch (kind) {
    case TK_BOOLEAN:
      return Number(Got<bool>(data, id, &DynamicData::get_bool_value));
    case TK_BYTE:
      return Number(Got<octet>(data, id, &DynamicData::get_byte_value));
    case TK_INT16:
      return Number(Got<std::int16_t>(data, id, &DynamicData::get_int16_value));
    case TK_INT32:
      return Number(Got<std::int32_t>(data, id, &DynamicData::get_int32_value));
    case TK_INT64:
      return Number(Got<std::int64_t>(data, id, &DynamicData::get_int64_value));
    case TK_UINT16:
      return Number(Got<std::uint16_t>(data, id, &DynamicData::get_uint16_value));
    case TK_UINT32:
      return Number(Got<std::uint32_t>(data, id, &DynamicData::get_uint32_value));
    case TK_UINT64:
      return Number(Got<std::uint64_t>(data, id, &DynamicData::get_uint64_value));
    case TK_FLOAT32:
      return Number(Got<float>(data, id, &DynamicData::get_float32_value));
    case TK_FLOAT64:
      return Number(Got<double>(data, id, &DynamicData::get_float64_value));
    case TK_CHAR8: {
      const auto value = Got<char>(data, id, &DynamicData::get_char8_value);
      return Text(value ? std::optional(std::string(1, *value)) : std::nullopt);
    }
    case TK_STRING8:
      return Text(Got<std::string>(data, id, &DynamicData::get_string_value));
    case TK_ENUM:
      return Text(Got<std::string>(data, id, &DynamicData::get_enum_value));
    case TK_STRUCTURE:
    case TK_SEQUENCE:
    case TK_ARRAY:
      return std::nullopt;
    default:  // float128, wide characters, unions, maps, bit masks
      return AnyField{{}, "not shown", AnyField::Form::none};
  }
}

class Walker {
 public:
  void Struct(DynamicData& data, const DynamicType_ptr& type, const std::string& prefix,
              int depth) {
    std::map<MemberId, DynamicTypeMember*> members;
    type->get_all_members(members);
    for (const auto& [id, member] : members) {
      Value(data, id, member->get_descriptor()->get_type(), prefix + member->get_name(), depth);
    }
  }
  std::vector<AnyField> Take() { return std::move(fields_); }

 private:
  void Value(DynamicData& data, MemberId id, const DynamicType_ptr& type, const std::string& name,
             int depth) {
    if (fields_.size() >= kMostFields) return;
    if (auto plain = Plain(data, id, type->get_kind())) {
      plain->name = name;
      fields_.push_back(std::move(*plain));
      return;
    }
    DynamicData* const inner = depth < kDeepest ? data.loan_value(id) : nullptr;
    if (inner == nullptr) return;
    if (type->get_kind() == TK_STRUCTURE) {
      Struct(*inner, type, name + ".", depth + 1);
    } else {
      const DynamicType_ptr element = type->get_descriptor()->get_element_type();
      const std::uint32_t count = inner->get_item_count();
      for (std::uint32_t i = 0; i < count && fields_.size() < kMostFields; ++i) {
        Value(*inner, i, element, fmt::format("{}[{}]", name, i), depth + 1);
      }
    }
    data.return_loaned_value(inner);
  }

  std::vector<AnyField> fields_;
};

}  // namespace

std::vector<AnyField> FieldsOf(DynamicData& sample, const DynamicType_ptr& type) {
  Walker walker;
  walker.Struct(sample, type, "", 0);
  return walker.Take();
}

}  // namespace baudgate::dds
