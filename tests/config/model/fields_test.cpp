// Tests that every member of the configuration's structs is visited and reported by its name.
// SPDX-License-Identifier: Apache-2.0
#include "config/model/fields.h"

#include <gtest/gtest.h>

#include <type_traits>
#include <utility>
#include <variant>

#include "config/model/config.h"

namespace baudgate::config {
namespace {

struct Anything {
  template <typename T>
  operator T() const;  // NOLINT: meant to be implicit
};

template <typename T, std::size_t... kIndices>
constexpr bool HasRoomFor(std::index_sequence<kIndices...>) {
  return requires { T{(void(kIndices), Anything())...}; };
}

template <typename T, std::size_t kCount = 64>
constexpr std::size_t CountMembers() {
  if constexpr (kCount > 0 && !HasRoomFor<T>(std::make_index_sequence<kCount>())) {
    return CountMembers<T, kCount - 1>();
  } else {
    return kCount;
  }
}

void Change(bool& value) { value = !value; }
void Change(std::string& text) { text += "+"; }
void Change(Decimal& number) { number = number + 1; }
void Change(Duration& time) { time += 1ns; }
void Change(Value& value) { value = value.index() == 1 ? Value(std::int64_t(1)) : Value(true); }
void Change(HostPort& at) { ++at.port; }
void Change(TlsFiles& files) { files.authorities += "/new.pem"; }
void Change(Quality& quality) { quality = Quality::bad_device_failure; }
void Change(Options& options) { options.Set("new", true); }
void Change(Timing& timing) { timing.reply = timing.reply.value_or(0ns) + 1ns; }
void Change(std::map<std::string, std::string>& names) { names["new"] = "one"; }
template <typename T>
requires std::is_arithmetic_v<T>
void Change(T& number) { number = static_cast<T>(number + 1); }
template <typename T>
requires std::is_enum_v<T>
void Change(T& word) { word = static_cast<T>(word == T{} ? 1 : 0); }
template <HasFields T>
void Change(T& its);
template <typename T>
void Change(std::vector<T>& list);
template <typename T>
void Change(Shared<T>& value) {
  T other = *value;
  Change(other);
  value = std::move(other);
}
template <typename T>
void Change(std::optional<T>& value) {
  if (value) return Change(*value);
  value.emplace();
}
template <typename T>
void Change(std::vector<T>& list) {
  list.emplace_back();
}
template <HasFields T>
void Change(T& its) {
  bool changed = false;
  VisitFields(&its, [&](auto field) {
    if constexpr (field.is_setting) {
      if (!std::exchange(changed, true)) Change(its.*field.member);
    }
  });
}

template <typename T>
class Fields : public ::testing::Test {};

using Structs =
    ::testing::Types<AlarmSetting, AllowWhen, ClientPriority, Config, Dds, DdsSecurity, Device,
                     Events, EventText, FunctionPriority, History, HistoryPoint, Identity, Line,
                     Listener, Modbus, Network, OnFault, Pace, Point, PointEvent, Record, Route,
                     Rs485, Sentinel, SerialSettings, Simulate, Web, Writing>;
TYPED_TEST_SUITE(Fields, Structs);

TYPED_TEST(Fields, AreAllVisited) {
  std::size_t visited = 0;
  const TypeParam* its = nullptr;
  VisitFields(its, [&visited](auto field) {
    visited += requires { field.member; }
    ? 1 : 0;
  });
  EXPECT_EQ(visited, CountMembers<TypeParam>());
}

TYPED_TEST(Fields, AreNamedByTheirKeyWhenTheyDiffer) {
  const TypeParam before{};
  EXPECT_EQ(DifferentKeys(before, before), "");
  VisitFields(&before, [&before](auto field) {
    TypeParam after = before;
    if constexpr (field.is_setting) {
      Change(after.*field.member);
      EXPECT_EQ(DifferentKeys(before, after), field.key);
      EXPECT_FALSE(Same(before, after)) << field.key;
    }
  });
}

TEST(Fields, KeysAreMemberNamesUnlessSetOtherwise) {
  EXPECT_EQ(MemberName<&Point::jump>(), "jump");
  EXPECT_EQ(MemberName<&Point::on_fault>(), "on_fault");
  EXPECT_EQ(Field<&Line::port>().key, "port");
  Point point;
  point.jump = 1;
  point.writing.allowed = true;
  EXPECT_EQ(DifferentKeys(point, Point()), "write, jump");
}

}  // namespace
}  // namespace baudgate::config
