// Tests that a masked configuration contains no secrets.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/copies.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::config {
namespace {

using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

/// YAML texts in which KEY is replaced by each secret key, and SECRET by its value.
const char* const kPlaces[] = {
    "lines:\n- { name: l, devices: [{ name: d, KEY: SECRET, address: 1 }] }\n",
    "lines:\n- devices:\n  - KEY: \"SECRET\"  # SECRET\n    name: d\n",
    "devices: { KEY: [SECRET, a] }\n",
    "devices: { KEY: { SECRET: b } }\n",
    "KEY: |\n  SECRET\n  SECRET too\n",
    "x: &p SECRET\nKEY: *p\n",
    "devices: [{ name: d, KEY:SECRET }]\n",
    "devices: [ KEY:SECRET, \"1 KEY:SECRET\" ]\n",
    "? [ KEY ]\n: SECRET\n",
    "KEYX: SECRET\n",
    "devices: [{ KEYX:SECRET, a: b }, { KEYX=SECRET }, KEYX SECRET, { KEYSECRET: 1 }]\n",
    "devices: [{ KEY: 47,hush,hush, name: d }]\n",
    "# KEY: SECRET\na: b\n",
};

std::string Put(std::string text, const std::string& mark, const std::string& value) {
  for (auto at = text.find(mark); at != std::string::npos;
       at = text.find(mark, at + value.size())) {
    text.replace(at, mark.size(), value);
  }
  return text;
}

TEST(MaskedConfig, MasksSecretsInEveryPlace) {
  for (const config::Catalog* catalog :
       {&baudgate::testing::Shipped(), &baudgate::testing::FakeCatalog()}) {
    const std::set<std::string> keys = SecretKeys(*catalog);
    ASSERT_FALSE(keys.empty());
    for (const std::string& key : keys) {
      for (const char* place : kPlaces) {
        const std::string yaml = Put(Put(place, "KEY", key), "SECRET", "4711hush");
        const auto masked = MaskedConfig(yaml, keys);
        ASSERT_TRUE(masked) << masked.error() << yaml;
        EXPECT_THAT(*masked, Not(HasSubstr("hush"))) << yaml;
      }
    }
  }
}

TEST(MaskedConfig, KnowsEveryKeyThatIsDeclaredSecret) {
  EXPECT_THAT(SecretKeys(baudgate::testing::FakeCatalog()), IsSupersetOf({"password", "pin"}));
  for (const auto& [name, protocol] : baudgate::testing::Shipped().protocols) {
    for (const protocols::OptionSpec& spec : protocol->options) {
      EXPECT_EQ(SecretKeys(baudgate::testing::Shipped()).contains(std::string(spec.name)),
                spec.secret)
          << name << " " << spec.name;
    }
  }
}

TEST(MaskedConfig, LeavesOtherKeysUnchanged) {
  EXPECT_EQ(*MaskedConfig("gateway: { name: a }\nlines:\n- { name: 'l 1', retries: 2 }\n"
                          "- poll: ~\n  password: 000000\n",
                          {"password"}),
            "gateway:\n  name: a\nlines:\n  - name: l 1\n    retries: 2\n"
            "  - poll: ~\n    password: \"***\"\n");
}

TEST(MaskedConfig, RefusesTextThatIsNotYaml) {
  EXPECT_THAT(MaskedConfig("a: [", {"password"}).error(), HasSubstr("not valid YAML"));
  EXPECT_FALSE(MaskedConfig("a: &a [*a]\n", {"password"}));
}

}  // namespace
}  // namespace baudgate::config
