// Tests the subcommands that need no running gateway: exit codes and the format of their output.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

class Cli : public Station {
 protected:
  std::string Configuration() const {
    return Write("good.yaml",
                 Head(true) + Line("bay", "spabus", "address: 1, profile: spaj140c, unit: 5"))
        .string();
  }
  std::vector<Json> Decode(std::vector<std::string> words, const std::string& captures) const {
    words.insert(words.begin(), "decode");
    words.push_back(Write("captures.txt", captures).string());
    const Finished decode = Command(words);
    EXPECT_EQ(decode.code, 0) << decode.errors;
    return JsonLines(decode.output);
  }
};

TEST_F(Cli, WrongArgumentsExitWithTheUsageCode) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{},
                                             {"serve"},
                                             {"run", "-c"},
                                             {"check", "--colour"},
                                             {"map", "-c", "x", "--csv", "--json"},
                                             {"simulate", "--profile", "spaj140c"},
                                             {"decode", "--protocol", "dcon"},
                                             {"demo", "--seconds", "-1"}}) {
    const Finished wrong = Command(words);
    EXPECT_EQ(wrong.code, kUsage) << ::testing::PrintToString(words) << wrong.output;
    EXPECT_THAT(wrong.errors, Not(IsEmpty())) << ::testing::PrintToString(words);
    EXPECT_THAT(wrong.output, IsEmpty()) << ::testing::PrintToString(words);
  }
  EXPECT_THAT(Command({"simulat"}).errors, HasSubstr("did you mean 'simulate'"));
  EXPECT_EQ(Command({"--help"}).code, 0);
  EXPECT_THAT(Command({"--version"}).output, StartsWith("baudgate "));
}

TEST_F(Cli, MistypedArgumentsSuggestACorrection) {
  const struct {
    std::vector<std::string> words;
    const char* says;
  } kMeant[] = {
      {{"scan", "/dev/x", "--protocl", "dcon"}, "baudgate scan: did you mean --protocol?"},
      {{"scan", "/dev/x", "--adresses=1-2"}, "did you mean --addresses?"},
      {{"--versoin"}, "did you mean --version?"},
      {{"certs", "dsd", "x"}, "baudgate certs: did you mean dds?"},
      {{"run", "first.yaml"}, "give the file with -c: baudgate run -c first.yaml"},
      {{"read", "--port", "/dev/x", "--serial", "19200", "8N1"}, "--serial \"19200 8N1\""},
      {{"simulate", "--baud", "9600", "7e1"}, "--baud \"9600 7e1\""},
      {{"ask", "127.0.0.1:4001", "00"}, "tcp://127.0.0.1:4001"},
      {{"bridge", "/dev/x", "--listen", "15364"}, "write 127.0.0.1:15364"},
      {{"ask", "/dev/x", "SI", "--protocol", "telegram"}, "add --profile, because"},
  };
  for (const auto& [words, says] : kMeant) {
    const Finished wrong = Command(words);
    EXPECT_EQ(wrong.code, kUsage) << ::testing::PrintToString(words);
    EXPECT_THAT(wrong.errors, HasSubstr(says)) << ::testing::PrintToString(words);
  }
}

TEST_F(Cli, LostStandardOutputIsAFailure) {
  for (const std::string words : {"protocols", "profiles", "--version", "demo --help"}) {
    const Finished full = RunToEnd({"/bin/sh", "-c", BAUDGATE_BINARY " " + words + " >/dev/full"},
                                   directory(), Environment());
    EXPECT_EQ(full.code, kCannotOpen) << words;
    EXPECT_THAT(full.errors, HasSubstr("standard output cannot be written")) << words;
  }
}

TEST_F(Cli, CheckJudgesAConfiguration) {
  const Finished good = Command({"check", "-c", Configuration()});
  EXPECT_EQ(good.code, 0) << good.errors;
  EXPECT_THAT(good.output, HasSubstr("bay-1"));
  EXPECT_THAT(good.errors, IsEmpty());

  const std::string bad = Write("bad.yaml", "lines:\n  - { nmae: x }\n").string();
  const Finished text = Command({"check", "-c", bad});
  EXPECT_EQ(text.code, kBadConfiguration);
  EXPECT_THAT(text.errors, HasSubstr(bad + ":2:"));
  const Finished json = Command({"check", "--json", "-c", bad});
  EXPECT_EQ(json.code, kBadConfiguration);
  const Json verdict = Json::parse(json.output);
  EXPECT_EQ(verdict["ok"], false);
  EXPECT_GE(verdict["problems"].size(), 1U);
}

TEST_F(Cli, MapShowsTheRegistersOfPoints) {
  const std::string file = Configuration();
  const Finished text = Command({"map", "--json", "-c", file});
  ASSERT_EQ(text.code, 0) << text.errors;
  const Json map = Json::parse(text.output);
  const auto& points = map["points"];
  const auto found = std::find_if(points.begin(), points.end(), [](const Json& point) {
    return point["point"] == "setting_group";
  });
  ASSERT_NE(found, points.end());
  EXPECT_EQ((*found)["modbus"]["unit"], 5);
  EXPECT_EQ((*found)["modbus"]["address"], 100);
  EXPECT_EQ((*found)["modbus"]["quality"], 20100);
  EXPECT_EQ((*found)["dds_key"], gateway() + "/bay-1/setting_group");

  const Finished csv = Command({"map", "--csv", "-c", file});
  EXPECT_EQ(csv.code, 0);
  EXPECT_THAT(csv.output, StartsWith("line,device,modbus_unit,point,"));
  const auto lines = std::count(csv.output.begin(), csv.output.end(), '\n');
  EXPECT_EQ(static_cast<std::size_t>(lines), points.size() + 1);
  EXPECT_EQ(Command({"map", "-c", LinkOf("nowhere.yaml")}).code, kBadConfiguration);
}

TEST_F(Cli, ProtocolsAndProfilesAreListed) {
  const Finished protocols = Command({"protocols"});
  EXPECT_EQ(protocols.code, 0);
  for (const char* name : {"spabus", "dcon", "set4tm"}) {
    EXPECT_THAT(protocols.output, HasSubstr(name));
    const Finished one = Command({"protocols", name, "--json"});
    EXPECT_EQ(one.code, 0);
    EXPECT_TRUE(Json::parse(one.output).is_object());
  }
  EXPECT_EQ(Command({"protocols", "telex"}).code, kUsage);

  const Finished profiles = Command({"profiles"});
  EXPECT_EQ(profiles.code, 0);
  for (const char* name : {"spaj140c", "owen-mv110-8a", "set-4tm.03m"}) {
    EXPECT_THAT(profiles.output, HasSubstr(name));
    const Finished one = Command({"profiles", name, "--json"});
    EXPECT_EQ(one.code, 0) << one.errors;
    EXPECT_FALSE(Json::parse(one.output).empty());
  }
  EXPECT_EQ(Command({"profiles", "telex"}).code, kUsage);
}

TEST_F(Cli, DecodeReadsCapturesOfEachProtocol) {
  const auto spa = Decode({"--protocol", "spabus", "--profile", "spaj140c"},
                          "inputs 1 to 5 of slave 2\n"
                          "> 3E 32 52 49 31 2F 35 3A 30 36 0D\n"
                          "< 0A 3C 32 44 3A 30 2E 35 32 2F 30 2E 34 39 2F\n"
                          "< 30 2E 35 31 2F 30 2E 30 30 2F 30 3A 37 34 0D 0A\n"
                          "the same, one digit damaged\n"
                          "> 3E 32 52 49 31 2F 35 3A 30 36 0D\n"
                          "< 0A 3C 32 44 3A 31 2E 35 32 2F 30 2E 34 39 2F 30 2E 35 31 2F 30 2E 30 "
                          "30 2F 30 3A 37 34 0D 0A\n"
                          "refused with code 7\n"
                          "> 3E 31 57 56 31 35 30 3A 31 3A 30 42 0D\n"
                          "< 0A 3C 31 4E 3A 37 3A 37 34 0D 0A\n"
                          "silence\n"
                          "> 3E 31 52 46 3A 32 31 0D\n");
  ASSERT_EQ(spa.size(), 4U);
  EXPECT_EQ(spa[0]["outcome"], "ok");
  ASSERT_EQ(spa[0]["values"].size(), 5U);
  EXPECT_EQ(spa[0]["values"][2]["point"], "current_l3");
  EXPECT_EQ(spa[0]["values"][2]["value"], 0.51);
  EXPECT_EQ(spa[1]["outcome"], "corrupt");
  EXPECT_TRUE(spa[1]["values"].empty());
  EXPECT_EQ(spa[2]["outcome"], "refused");
  EXPECT_EQ(spa[3]["outcome"], "no_reply");

  const auto dcon = Decode({"--protocol", "dcon", "--set", "checksum=true"},
                           "> 23 30 31 38 34 0D\n"
                           "< 3E 2B 31 30 30 2E 32 33 2B 33 34 2E 30 35 30 45 32 0D\n");
  ASSERT_EQ(dcon.size(), 1U);
  EXPECT_EQ(dcon[0]["outcome"], "ok") << dcon[0];
  ASSERT_EQ(dcon[0]["values"].size(), 2U);
  EXPECT_EQ(dcon[0]["values"][0]["value"], 100.23);
  EXPECT_EQ(dcon[0]["values"][1]["value"], 34.05);

  const auto meter = Decode({"--protocol", "set4tm"},
                            "> C8 08 1B 00 11 77 BB\n"
                            "< C8 00 80 66 43 AE 69\n"
                            "> 05 05 00 02 91 28\n"
                            "< 05 05 C2 E3\n");
  ASSERT_EQ(meter.size(), 2U);
  EXPECT_EQ(meter[0]["outcome"], "ok") << meter[0];
  ASSERT_EQ(meter[0]["values"].size(), 1U);
  EXPECT_EQ(meter[0]["values"][0]["value"], 230.5);
  EXPECT_NE(meter[1]["outcome"], "ok") << "its channel is not open";
  EXPECT_TRUE(meter[1]["values"].empty());
}

TEST_F(Cli, DecodeReportsUnusableInput) {
  const std::string good = Write("good.txt", "> 23 30 31 0D\n").string();
  const std::string bad = Write("bad.txt", "> 23 3\n").string();
  const std::string orphan = Write("orphan.txt", "< 23 30\n").string();
  EXPECT_EQ(Command({"decode", "--protocol", "dcon", LinkOf("nowhere.txt")}).code, kCannotOpen);
  EXPECT_EQ(Command({"decode", "--protocol", "dcon", bad}).code, kUsage);
  EXPECT_EQ(Command({"decode", "--protocol", "dcon", orphan}).code, kUsage);
  const std::string words = Write("words.txt", "no exchange in here\n").string();
  EXPECT_EQ(Command({"decode", "--protocol", "dcon", words}).code, kUsage);
  EXPECT_EQ(Command({"decode", "--protocol", "dcon", "/"}).code, kUsage) << "a folder";
  EXPECT_EQ(Command({"decode", "--protocol", "telex", good}).code, kBadConfiguration);
  EXPECT_EQ(Command({"decode", "--protocol", "dcon", "--set", "colour=red", good}).code,
            kBadConfiguration);
  const Finished unknown = Command({"decode", "--protocol", "dcon", "--profile", "telex", good});
  EXPECT_EQ(unknown.code, kBadConfiguration);
  EXPECT_THAT(unknown.errors, HasSubstr("telex"));
}

TEST_F(Cli, SimulateReportsWhyATwinCannotStart) {
  const auto simulate = [&](const std::string& profile, const std::string& address,
                            const std::string& pty) {
    return Command({"simulate", "--profile", profile, "--address", address, "--pty", pty});
  };
  const Finished profile = simulate("telex", "1", LinkOf("bay"));
  EXPECT_EQ(profile.code, kBadConfiguration);
  EXPECT_THAT(profile.errors, HasSubstr("telex"));
  const Finished address = simulate("spaj140c", "1000", LinkOf("bay"));
  EXPECT_EQ(address.code, kBadConfiguration);
  EXPECT_THAT(address.errors, HasSubstr("1000"));
  EXPECT_EQ(simulate("spaj140c", "1", LinkOf("no/such/directory")).code, kCannotOpen);
  const std::string file = Write("occupied", "a file of somebody").string();
  EXPECT_EQ(simulate("spaj140c", "1", file).code, kCannotOpen);
  EXPECT_EQ(ReadWholeFile(file), "a file of somebody");
}

TEST_F(Cli, SimulateMakesAnAsciiTwinOfAnRtuProfile) {
  const auto twin = Start({"simulate", "--protocol", "modbus_ascii", "--profile",
                           "mitsubishi-fr-d700", "--address", "20", "--pty", LinkOf("bay")});
  const auto answers = [&] { return twin->Output().find("answers on") != std::string::npos; };
  ASSERT_TRUE(Eventually(answers)) << twin->Output();
  const std::string request = ":140300C8000120\r\n";
  const int pty = ::open(LinkOf("bay").c_str(), O_RDWR | O_NOCTTY);
  ASSERT_GE(pty, 0);
  ASSERT_EQ(::write(pty, request.data(), request.size()), static_cast<ssize_t>(request.size()));
  std::string reply;
  for (char c = 0; !reply.ends_with('\n') && ::read(pty, &c, 1) == 1;) reply += c;
  ::close(pty);
  EXPECT_THAT(reply, StartsWith(":140302"));
}

TEST_F(Cli, ASettingWithoutEqualsIsNotShown) {
  const Finished decode =
      Command({"decode", "--protocol", "set4tm", "--set", "passwordSECRET", "-"});
  EXPECT_EQ(decode.code, kBadConfiguration);
  EXPECT_THAT(decode.errors, HasSubstr("key=value"));
  EXPECT_THAT(decode.errors, Not(HasSubstr("SECRET")));
}

TEST_F(Cli, SimulateRemovesItsLinkAtItsEnd) {
  const auto twin = StartTwin("bay", "spaj140c", "1");
  EXPECT_THAT(twin->Output(), HasSubstr("SPAJ 140 C"));
  EXPECT_THAT(twin->Output(), HasSubstr(LinkOf("bay")));
  twin->Signal(SIGTERM);
  EXPECT_EQ(twin->WaitForEnd(10s), 0);
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(LinkOf("bay"))));
}

TEST_F(Cli, DemoReadsEveryTwin) {
  const Finished demo = Command({"demo", "--seconds", "8", "--port", std::to_string(port()),
                                 "--domain", std::to_string(domain())});
  EXPECT_EQ(demo.code, 0) << demo.output << demo.errors;
  EXPECT_THAT(demo.output, HasSubstr("spaj140c"));
  EXPECT_THAT(demo.output, HasSubstr("current_l1"));
}

}  // namespace
}  // namespace baudgate::system_test
