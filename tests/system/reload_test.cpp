// Tests reloads: unchanged lines, bad files, trials and rollbacks, also after kill -9.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "tests/system/notify_socket.h"
#include "tests/system/reload_fixture.h"
#include "tests/system/steady_client.h"

namespace baudgate::system_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(Reload, OfOneLineDoesNotDisturbTheOtherLines) {
  StartAll(YamlWithSocket());
  SteadyClient steady(port(), [](ModbusClient& its) { return its.Input(kRelayUnit, 0, 2).ok(); });
  ASSERT_TRUE(steady.GoesOn());
  const Json before = Status();

  SetFile(WithSlowerIo());
  const Finished dry = Ask({"reload", "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.errors;
  EXPECT_EQ(dry.output,
            "line io: restarts; changed: poll of io-1\n1 line restarted; 2 lines untouched\n");
  EXPECT_EQ(Status()["configuration"]["applied"], before["configuration"]["applied"]);

  for (int round = 0; round < 5; ++round) {
    SetFile(round % 2 == 0 ? WithSlowerIo() : YamlWithSocket());
    const Finished reload = Ask({"reload"});
    EXPECT_EQ(reload.code, 0) << reload.errors;
    EXPECT_EQ(reload.output, dry.output);
    ASSERT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
  }
  EXPECT_EQ(steady.Stop(), 0) << "of " << steady.asked();

  const Json after = Status();
  EXPECT_EQ(after["lines"].size(), 3U);
  for (const char* name : {"relay", "meter"}) {
    const Json was = LineOf(before, name);
    const Json is = LineOf(after, name);
    EXPECT_EQ(is["port_since"], was["port_since"]) << name;
    EXPECT_EQ(is["times_lost"], 0) << name;
    const Json& device = is["devices"][0];
    EXPECT_EQ(device["missed"], was["devices"][0]["missed"]) << name;
    EXPECT_GT(device["exchanges"], was["devices"][0]["exchanges"]) << name;
    EXPECT_EQ(device["outcomes"]["ok"], device["exchanges"]) << name;
  }
  EXPECT_LT(LineOf(after, "io")["devices"][0]["exchanges"],
            LineOf(after, "relay")["devices"][0]["exchanges"])
      << "it was begun anew";
}

TEST_F(Reload, OfAModbusUnitKeepsTheValuesAndTheOpenPort) {
  const std::string yaml =
      Replaced(YamlWithSocket(), "unit: 1, poll: 200ms", "unit: 1, poll: 10min");
  StartAll(yaml);
  const Json before = LineOf(Status(), "relay");
  SetFile(Replaced(yaml, "unit: 1, poll: 10min", "unit: 2, poll: 10min"));
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 0) << reload.errors;
  EXPECT_THAT(reload.output, HasSubstr("line relay: keeps running; changed: unit of relay-1"));
  EXPECT_EQ(client.Float(2, 0), 1.25F);
  EXPECT_EQ(client.Input(1, 0, 2).exception, kNoPath);
  const Json after = LineOf(Status(), "relay");
  EXPECT_EQ(after["port_since"], before["port_since"]);
  EXPECT_GE(after["devices"][0]["exchanges"], before["devices"][0]["exchanges"]);
}

TEST_F(Reload, AddsAndRemovesLines) {
  StartAll(YamlWithSocket());
  const std::string all = YamlWithSocket();
  SetFile(all.substr(0, all.find("  - name: meter")));
  Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.output, "line meter: is removed\n1 line removed; 2 lines untouched\n")
      << reload.errors;
  EXPECT_EQ(client.Input(kMeterUnit, 0, 2).exception, kNoPath);
  EXPECT_EQ(Status()["lines"].size(), 2U);
  EXPECT_EQ(Ask({"status", "meter"}).code, 2);

  SetFile(all);
  reload = Ask({"reload"});
  EXPECT_EQ(reload.output, "line meter: is new\n1 line new; 2 lines untouched\n") << reload.errors;
  EXPECT_TRUE(EventuallyFloat(client, kMeterUnit, 0, -61234.5F));
  EXPECT_EQ(Ask({"status", "meter.meter-1"}).code, 0);
  EXPECT_EQ(Ask({"reload"}).output, "nothing has changed\n");
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

/// The released port is in use by another program, so the reload must not open it.
TEST_F(Reload, KeepsManualReleasesAndDisabledDevices) {
  StartAll(YamlWithSocket());
  ASSERT_EQ(Ask({"release", "io", "--for", "10min"}).code, 0);
  ASSERT_EQ(Ask({"disable", "relay.relay-1"}).code, 0);
  SetFile(Replaced(WithSlowerIo(), "unit: 1, poll: 200ms", "unit: 1, poll: 250ms"));
  const Finished reload = Ask({"reload"});
  EXPECT_THAT(reload.output, HasSubstr("2 lines restarted")) << reload.errors;
  ASSERT_TRUE(Eventually([&] { return LineOf(Status(), "io")["port_state"] == "released"; }));
  EXPECT_TRUE(
      Eventually([&] { return LineOf(Status(), "relay")["devices"][0]["state"] == "disabled"; }));
  EXPECT_EQ(LineOf(Status(), "io")["exchanges"], 0) << "it was never open";
  ASSERT_EQ(Ask({"release", "io", "--end"}).code, 0);
  ASSERT_EQ(Ask({"enable", "relay.relay-1"}).code, 0);
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
  EXPECT_TRUE(EventuallyFloat(client, kRelayUnit, 0, 1.25F));
}

TEST_F(Reload, OfABadFileChangesNothingAndReportsWhy) {
  NotifySocket notify(directory() / "notify");
  StartTwins();
  SetFile(YamlWithSocket());
  daemon =
      Start({"run", "-c", file().string()}, {{"NOTIFY_SOCKET", (directory() / "notify").string()}});
  ASSERT_THAT(notify.Receive(), HasSubstr("READY=1"));
  ASSERT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));

  const std::string bad = Replaced(YamlWithSocket(), "poll: 300ms", "poll: often");
  SetFile(bad);
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 2);
  EXPECT_THAT(reload.errors, HasSubstr(file().string() + ":"));
  EXPECT_THAT(reload.errors, HasSubstr("often"));
  EXPECT_EQ(Ask({"reload", "--dry-run"}).code, 2);
  daemon->Signal(SIGHUP);
  EXPECT_TRUE(EventuallyLogged(*daemon, "reload: nothing is changed: " + file().string()));

  SetFile(Replaced(YamlWithSocket(), "domain: " + std::to_string(domain()), "domain: 200"));
  const Finished restart = Ask({"reload"});
  EXPECT_EQ(restart.code, 2);
  EXPECT_THAT(restart.errors, HasSubstr("only a restart can change dds.domain"));
  EXPECT_EQ(client.Float(kModuleUnit, 0), 100.25F);
  EXPECT_THAT(notify.Receive(MSG_DONTWAIT), Not(HasSubstr("RELOADING")));

  SetFile(WithSlowerIo());
  daemon->Signal(SIGHUP);
  EXPECT_THAT(notify.Receive(), AllOf(HasSubstr("RELOADING=1"), HasSubstr("MONOTONIC_USEC=")));
  EXPECT_THAT(notify.Receive(), AllOf(HasSubstr("READY=1"), HasSubstr("STATUS=")));
  EXPECT_TRUE(EventuallyLogged(*daemon, "reload by SIGHUP: 1 line restarted"));
}

TEST_F(Reload, AnUnconfirmedTrialIsRolledBackAndStaysRolledBack) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  const Finished reload = Ask({"reload", "--confirm", FormatDuration(kLongEnough)});
  ASSERT_EQ(reload.code, 0) << reload.errors;
  EXPECT_THAT(reload.output, HasSubstr("baudgate confirm"));
  EXPECT_FALSE(Status()["configuration"]["confirm_until"].is_null());
  EXPECT_THAT(Ask({"status"}).output, HasSubstr("configuration: is on trial"));
  ASSERT_TRUE(EventuallyLogged(*daemon, "nobody ran 'baudgate confirm' in time"));
  ASSERT_TRUE(Eventually([&] { return Status()["configuration"]["not_the_file"] != ""; }));
  EXPECT_FALSE(RunsSlower());
  EXPECT_THAT(Ask({"status"}).output, HasSubstr("is not in use: nobody ran 'baudgate confirm'"));
  EXPECT_EQ(ReadWholeFile(file()), WithSlowerIo()) << "the file is the user's";
  const Finished check = Command({"check", "-c", file().string()});
  EXPECT_EQ(check.code, 0);
  EXPECT_THAT(check.errors, HasSubstr("is not in use: nobody ran 'baudgate confirm'"));
  EXPECT_EQ(Ask({"confirm"}).code, 2);
  for (const char* dry : {"--dry-run", ""}) {
    const Finished again = Ask(*dry == 0 ? std::vector<std::string>{"reload"}
                                         : std::vector<std::string>{"reload", dry});
    EXPECT_EQ(again.code, 2);
    EXPECT_THAT(again.errors,
                AllOf(HasSubstr("is not in use: nobody ran 'baudgate confirm' in time"),
                      HasSubstr("to try the file again")));
  }

  for (int start = 0; start < 2; ++start) {
    daemon->Signal(SIGTERM);
    ASSERT_EQ(daemon->WaitForEnd(10s), 0);
    daemon = StartDaemon(WithSlowerIo());
    EXPECT_THAT(daemon->Errors(), HasSubstr("is not in use"));
    EXPECT_FALSE(RunsSlower());
  }
  daemon->Signal(SIGTERM);
  ASSERT_EQ(daemon->WaitForEnd(10s), 0);
  daemon = StartDaemon(WithSlowerIo() + "# meant\n");
  EXPECT_EQ(Status()["configuration"]["not_the_file"], "");
  EXPECT_TRUE(RunsSlower());
}

TEST_F(Reload, ATrialContinuesAfterOtherReloads) {
  StartAll(YamlWithSocket());
  const auto with_slower_relay = [](const std::string& yaml) {
    return Replaced(yaml, "unit: 1, poll: 200ms", "unit: 1, poll: 250ms");
  };
  SetFile(WithSlowerIo());
  EXPECT_EQ(Ask({"reload", "--confirm", "0s"}).code, 2);
  ASSERT_EQ(Ask({"reload", "--confirm", "60s"}).code, 0);
  const Finished same = Ask({"reload"});
  EXPECT_EQ(same.code, 0) << same.errors;
  EXPECT_THAT(
      same.output,
      AllOf(HasSubstr(
                "nothing has changed\nthe gateway goes back to the confirmed configuration in "),
            HasSubstr("baudgate confirm")));
  daemon->Signal(SIGHUP);
  EXPECT_TRUE(
      EventuallyLogged(*daemon, "reload by SIGHUP: nothing has changed; confirm it within"));
  for (const std::string& yaml :
       {WithSlowerIo() + "# looked at\n", with_slower_relay(WithSlowerIo())}) {
    SetFile(yaml);
    const Finished other = Ask({"reload"});
    EXPECT_EQ(other.code, 0) << other.errors;
    EXPECT_THAT(other.output, HasSubstr("baudgate confirm"));
    EXPECT_FALSE(Status()["configuration"]["confirm_until"].is_null());
  }
  const Finished other_time = Ask({"reload", "--confirm", "2s"});
  EXPECT_THAT(other_time.output,
              HasSubstr("the gateway goes back to the confirmed configuration in 2s"));
  ASSERT_TRUE(EventuallyLogged(*daemon, "is not in use: nobody ran 'baudgate confirm' in time"));
  EXPECT_TRUE(EventuallyLogged(*daemon, "reload: line io: restarts; changed: poll of io-1"));
  SetFile(YamlWithSocket());
  EXPECT_EQ(Ask({"reload"}).output, "nothing has changed\n") << "it is what was confirmed";
  EXPECT_EQ(Status()["configuration"]["not_the_file"], "");
}

TEST_F(Reload, OfTheConfirmedFileEndsATrial) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "60s"}).code, 0);
  SetFile(YamlWithSocket());
  const Finished back = Ask({"reload"});
  EXPECT_EQ(back.code, 0) << back.errors;
  EXPECT_THAT(back.output, Not(HasSubstr("baudgate confirm")));
  EXPECT_TRUE(Status()["configuration"]["confirm_until"].is_null());
  EXPECT_EQ(Ask({"confirm"}).code, 2);
  daemon->Signal(SIGKILL);
  daemon->WaitForEnd();
  daemon = StartDaemon(YamlWithSocket());
  EXPECT_THAT(daemon->Errors(), Not(HasSubstr("is not in use")));
}

TEST_F(Reload, AConfirmedTrialSurvivesAKill) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "60s"}).code, 0);
  const Finished confirm = Ask({"confirm"});
  ASSERT_EQ(confirm.code, 0) << confirm.errors;
  daemon->Signal(SIGKILL);
  daemon->WaitForEnd();
  daemon = StartDaemon(WithSlowerIo());
  EXPECT_TRUE(RunsSlower());
}

TEST_F(Reload, ATrialIsRolledBackAfterAKill) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "60s"}).code, 0);
  EXPECT_TRUE(RunsSlower());
  daemon->Signal(SIGKILL);
  daemon->WaitForEnd();
  daemon = StartDaemon(WithSlowerIo());
  EXPECT_THAT(daemon->Errors(),
              HasSubstr("the gateway ended before the configuration was confirmed"));
  EXPECT_FALSE(RunsSlower());
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
}

TEST_F(Reload, ARollbackAfterAKillWithoutACopyReportsWhatToDo) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "60s"}).code, 0);
  daemon->Signal(SIGKILL);
  daemon->WaitForEnd();
  std::filesystem::remove(ConfirmedCopy());
  const Finished start = Command({"run", "-c", file().string()});
  EXPECT_EQ(start.code, 3);
  EXPECT_THAT(start.errors,
              AllOf(HasSubstr("the confirmed configuration " + ConfirmedCopy().string()),
                    HasSubstr("correct " + file().string())));
  daemon = StartDaemon(WithSlowerIo() + "# meant\n");
  EXPECT_TRUE(EventuallyLogged(*daemon, "the gateway ended while a configuration was on trial"));
}

TEST_F(Reload, ATrialThatLosesADeviceIsRolledBackAtOnce) {
  StartAll(YamlWithSocket());
  const std::string wrong =
      Replaced(YamlWithSocket(), "address: 1, profile: module", "address: 5, profile: module");
  SetFile(wrong);
  ASSERT_EQ(Ask({"reload", "--confirm", "10s"}).code, 0);
  ASSERT_TRUE(EventuallyLogged(*daemon, "io.io-1 worked before"));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
}

TEST_F(Reload, ATrialIsRolledBackWhenADeviceFallsSilentLater) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "60s"}).code, 0);
  ASSERT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
  io->Signal(SIGSTOP);
  EXPECT_TRUE(EventuallyLogged(*daemon, "io.io-1 worked before the change, and fails now"));
}

TEST_F(Reload, StatusReportsAFileThatWasEditedAndNotReloaded) {
  StartAll(YamlWithSocket());
  const auto said = [this] { return Status()["configuration"]["file_changed"].get<std::string>(); };
  SetFile(WithSlowerIo());
  ASSERT_TRUE(Eventually([&] { return !said().empty(); }));
  EXPECT_THAT(said(),
              HasSubstr("differs from the running configuration: 'baudgate reload --dry-run'"));
  ASSERT_EQ(Ask({"reload"}).code, 0);
  EXPECT_EQ(said(), "");
  std::filesystem::remove(file());
  ASSERT_TRUE(Eventually([&] { return !said().empty(); }));
  EXPECT_THAT(said(), HasSubstr("cannot be read: No such file"));
}

/// Uses the command of docs/reload.md.
TEST_F(Reload, ARollbackLeavesACopyOfTheConfirmedFile) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "1s"}).code, 0);
  ASSERT_TRUE(EventuallyLogged(*daemon, "is not in use: nobody ran 'baudgate confirm' in time"));
  const std::string copy = ConfirmedCopy().string();
  const Finished check = Command({"check", "-c", file().string()});
  EXPECT_THAT(check.errors, AllOf(HasSubstr(copy + " runs until you change this file"),
                                  HasSubstr("diff " + copy + " " + file().string() + ")")));
  std::filesystem::permissions(file(), std::filesystem::perms(0640));
  const Finished copied = RunToEnd({"/bin/cp", copy, file().string()}, directory(), Environment());
  ASSERT_EQ(copied.code, 0) << copied.errors;
  EXPECT_EQ(ReadWholeFile(file()), YamlWithSocket());
  EXPECT_EQ(std::filesystem::status(file()).permissions(), std::filesystem::perms(0640));
  EXPECT_EQ(Ask({"reload"}).output, "nothing has changed\n");
  EXPECT_EQ(Status()["configuration"]["not_the_file"], "");
}

namespace fs = std::filesystem;

class ReloadLimits : public Reload {
 protected:
  /// Lets the daemon open this many more files. RLIMIT_NOFILE limits the numbers of descriptors,
  /// not their count, so the free numbers are counted.
  void Leave(int more) const {
    const fs::path open = "/proc/" + std::to_string(daemon->id()) + "/fd";
    rlim_t number = 0;
    for (int free = 0; free < more; ++number) {
      free += fs::exists(fs::symlink_status(open / std::to_string(number))) ? 0 : 1;
    }
    const rlimit limit{number, number};
    ASSERT_EQ(::prlimit(daemon->id(), RLIMIT_NOFILE, &limit, nullptr), 0);
  }
  std::string WithoutMeter() const {
    const std::string all = YamlWithSocket();
    return all.substr(0, all.find("  - name: meter"));
  }
};

TEST_F(ReloadLimits, AReloadWithoutFreeDescriptorsChangesNothing) {
  StartAll(YamlWithSocket());
  SetFile(WithoutMeter());
  ASSERT_EQ(Ask({"reload"}).code, 0);
  Leave(2);
  SetFile(YamlWithSocket());
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 4);
  EXPECT_THAT(
      reload.errors,
      AllOf(HasSubstr("line meter: no thread could be started for its port: Too many open files"),
            HasSubstr("nothing is changed")));
  const std::string at = "listen: \"127.0.0.1:" + std::to_string(port()) + "\"";
  SetFile(Replaced(
      WithoutMeter(), at,
      "listen: [ \"127.0.0.1:" + std::to_string(port()) + "\", " + LinkOf("master") + " ]"));
  const Finished master = Ask({"reload"});
  EXPECT_EQ(master.code, 4);
  EXPECT_THAT(master.errors, HasSubstr("listener " + LinkOf("master") + ": Too many open files"));
  EXPECT_EQ(Status()["modbus"]["masters"].size(), 0U);
  EXPECT_EQ(Status()["lines"].size(), 2U);
  EXPECT_EQ(client.Float(kModuleUnit, 0), 100.25F);
}

TEST_F(ReloadLimits, ATrialIsRolledBackWithoutFreeDescriptors) {
  StartAll(YamlWithSocket());
  SetFile(WithoutMeter());
  ASSERT_EQ(Ask({"reload", "--confirm", "3s"}).code, 0);
  Leave(1);
  ASSERT_TRUE(EventuallyLogged(*daemon, "is not in use: nobody ran 'baudgate confirm' in time"));
  EXPECT_THAT(daemon->Errors(), HasSubstr("line meter: no thread could be started for its port"));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

TEST_F(ReloadLimits, ATrialIsRolledBackWithoutCopyAndProfile) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "2s"}).code, 0);
  fs::remove(ConfirmedCopy());
  Station::Write("profiles/dcon/module.yaml", "no profile");
  ASSERT_TRUE(EventuallyLogged(*daemon, "is not in use: nobody ran 'baudgate confirm' in time"));
  EXPECT_TRUE(EventuallyLogged(*daemon, "reload: line io: restarts; changed: poll of io-1"));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
}

TEST_F(ReloadLimits, AStartWithoutDescriptorsNamesTheLimit) {
  SetFile(YamlWithSocket());
  const Finished start =
      RunToEnd({"/bin/sh", "-c", "ulimit -n 8; exec " BAUDGATE_BINARY " run -c " + file().string()},
               directory(), Environment());
  EXPECT_EQ(start.code, 4);
  EXPECT_THAT(start.errors, AllOf(HasSubstr("Too many open files"), HasSubstr("LimitNOFILE")));
}

TEST_F(ReloadLimits, AReloadOfAPipeIsRefusedWithoutWaiting) {
  StartAll(YamlWithSocket());
  fs::remove(file());
  ASSERT_EQ(::mkfifo(file().c_str(), 0600), 0);
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 2);
  EXPECT_THAT(reload.errors, HasSubstr("is not a regular file"));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

}  // namespace
}  // namespace baudgate::system_test
