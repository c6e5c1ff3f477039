// Tests of sessions with a real mosquitto.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/session.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "gateway/outputs/pki/demo_pki.h"
#include "tests/gateway/outputs/mqtt/fixture.h"
#include "tests/support/keeping_sink.h"
#include "tests/support/mqtt_broker.h"

namespace baudgate::mqtt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kCurrent[] = "baudgate/gate/bay/feeder/current";
constexpr char kStatus[] = "baudgate/gate/status";

/// A gateway whose session runs on a thread, and a broker that is not started yet.
class SessionTest : public ::testing::Test {
 protected:
  /// A broker that is stopped by SIGTERM keeps the waiting messages of listeners that have an id.
  explicit SessionTest(const std::string& more =
                           "allow_anonymous true\npersistence true\n"
                           "persistence_location DIR/\n"
                           "max_queued_messages 0\n")
      : broker_(more) {}
  ~SessionTest() override { StopSession(); }

  void StartSession() { session_.Start(config_, {store_, sink_, feed_, cursors_, true}); }
  void StopSession() { session_.Stop(); }
  void Set(std::uint32_t point, const Value& value, Quality quality = Quality::good) {
    const std::vector<bus::Sample> samples = {{point, value, quality}};
    store_.Update(0, samples, ReadClocks(), 1ms);
  }
  bool TroubleIs(const std::string& part) {
    const bool is = MqttListener::Wait(
        [&] { return session_->state().trouble.find(part) != std::string::npos; }, 10s);
    EXPECT_TRUE(is) << session_->state().trouble;
    return is;
  }
  static events::EventRecord Event(std::int64_t seq) {
    events::EventRecord record;
    record.seq = seq;
    record.device = "feeder";
    record.text = "event " + std::to_string(seq);
    return record;
  }
  void AddEvents(std::int64_t first, std::int64_t last) {
    std::vector<events::EventRecord> events;
    for (std::int64_t seq = first; seq <= last; ++seq) events.push_back(Event(seq));
    feed_->Add(std::move(events));
  }

  MqttBroker broker_;
  config::Config config_ = testing::GatewayConfig(broker_.port());
  bus::PointStore store_{config_};
  KeepingSink sink_;
  std::shared_ptr<events::EventFeed> feed_ = std::make_shared<events::EventFeed>();
  std::shared_ptr<events::CursorBook> cursors_ =
      std::make_shared<events::CursorBook>(std::set<std::string>{Session::kConsumer});
  testing::RunningSession session_;
};

TEST_F(SessionTest, PublishesValuesThenOnlineAndAgainAfterTheBrokerHasLostThem) {
  ASSERT_TRUE(broker_.Start());
  MqttListener listener(broker_.port(), "baudgate/#");
  Set(0, 12.5);
  StartSession();
  ASSERT_TRUE(listener.WaitFor(kStatus, "online"));
  EXPECT_TRUE(session_.connected());
  const auto messages = listener.messages();
  EXPECT_EQ(messages.back().topic == "baudgate/gate/alarms" || messages.back().topic == kStatus,
            true)
      << "the values come before `online`";
  EXPECT_THAT(listener.Last(kCurrent), HasSubstr("{\"value\":12.5,\"quality\":\"good\""));
  EXPECT_THAT(listener.Last("baudgate/gate/bay/feeder/text"), HasSubstr("\"quality\":\"bad\""));
  Set(0, 13.5);
  EXPECT_TRUE(listener.WaitFor(kCurrent, "13.5"));
  store_.SetOverride(0, Quality(Quality::bad_not_connected));
  EXPECT_TRUE(listener.WaitFor(kCurrent, "\"value\":null,\"quality\":\"bad\""));
  store_.SetOverride(0, std::nullopt);
  EXPECT_TRUE(listener.WaitFor(kCurrent, "13.5"));

  broker_.Kill();
  std::filesystem::remove(broker_.folder() / "mosquitto.db");
  TroubleIs("the broker mqtt:");
  ASSERT_TRUE(broker_.Start());
  MqttListener late(broker_.port(), "baudgate/#");
  EXPECT_TRUE(late.WaitFor(kCurrent, "13.5"));
  EXPECT_TRUE(late.WaitFor(kStatus, "online"));
  EXPECT_EQ(session_->state().times_lost, 1U);
  EXPECT_EQ(session_->state().trouble, "");

  StopSession();
  EXPECT_TRUE(late.WaitFor(kStatus, "offline"));
  EXPECT_TRUE(late.WaitFor(kCurrent, "\"quality\":\"bad\""));
  MqttListener last(broker_.port(), "baudgate/#");
  EXPECT_TRUE(last.WaitFor(kCurrent, "\"value\":null")) << "no retained value looks good";
}

TEST_F(SessionTest, DeliversEachEventInOrderAndMovesItsCursorAfterTheBroker) {
  ASSERT_TRUE(broker_.Start());
  MqttListener listener(broker_.port(), "baudgate/gate/events", "observer");
  std::vector<events::EventRecord> old;
  for (std::int64_t seq = 1; seq <= 500; ++seq) old.push_back(Event(seq));
  feed_->Begin({.newest = 500, .events = old});
  cursors_->Set(Session::kConsumer, {100, true});
  StartSession();
  const auto at = [&](std::int64_t seq) {
    return MqttListener::Wait([&] { return cursors_->Of(Session::kConsumer)->seq == seq; });
  };
  EXPECT_TRUE(at(500));
  broker_.Kill(SIGTERM);
  AddEvents(501, 900);
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(cursors_->Of(Session::kConsumer)->seq, 500)
      << "the broker has confirmed no event after 500";
  ASSERT_TRUE(broker_.Start());
  AddEvents(901, 950);
  EXPECT_TRUE(at(950));
  std::int64_t next = 101;
  EXPECT_TRUE(MqttListener::Wait([&] { return listener.messages().size() >= 850; }));
  for (const auto& message : listener.messages()) {
    const auto seq = nlohmann::json::parse(message.payload)["seq"].get<std::int64_t>();
    EXPECT_FALSE(message.retained);
    ASSERT_LE(seq, next) << "none is missing, and they come in order";
    if (seq == next) ++next;
  }
  EXPECT_EQ(next, 951);
  EXPECT_EQ(session_->state().events_skipped, 0U);
}

TEST_F(SessionTest, SaysThatItCannotKnowAfterARestore) {
  ASSERT_TRUE(broker_.Start());
  feed_->Begin({.newest = 5, .events = {Event(5)}});
  cursors_->Set(Session::kConsumer, {80, true});
  StartSession();
  EXPECT_TRUE(MqttListener::Wait(
      [&] { return session_->state().events_note.find("cannot know") != std::string::npos; }));
  AddEvents(6, 7);
  EXPECT_TRUE(MqttListener::Wait([&] { return cursors_->Of(Session::kConsumer)->seq == 7; }));
}

outlet::Portion PortionOf(std::initializer_list<const char*> points) {
  outlet::Portion portion;
  std::int64_t time = 1'790'000'000'000;
  for (const char* point : points) {
    portion.values.push_back({point, {time, 1.5, Quality::good}, time});
    ++time;
  }
  return portion;
}

struct Awaited {
  std::mutex mutex;
  std::vector<outlet::Answer> answers;
  void operator()(outlet::Answer answer) {
    const std::lock_guard lock(mutex);
    answers.push_back(std::move(answer));
  }
  outlet::Answer Wait() {
    MqttListener::Wait([this] {
      const std::lock_guard lock(mutex);
      return !answers.empty();
    });
    const std::lock_guard lock(mutex);
    EXPECT_EQ(answers.size(), 1U) << "`done` is called once";
    return std::exchange(answers, {}).front();
  }
};

TEST_F(SessionTest, StoredValuesAreNotRetainedAndAreConfirmedByTheBroker) {
  Awaited awaited;
  StartSession();
  session_->Send(PortionOf({"bay.feeder.current"}), std::ref(awaited));
  EXPECT_EQ(awaited.Wait().kind, outlet::Answer::Kind::retry) << "there is no broker";
  ASSERT_TRUE(broker_.Start());
  EXPECT_TRUE(MqttListener::Wait([&] { return session_.connected(); }));
  MqttListener listener(broker_.port(), "baudgate/gate/+/+/+/history");
  session_->Send(PortionOf({"bay.feeder.current", "bay.feeder.gone"}), std::ref(awaited));
  EXPECT_EQ(awaited.Wait().kind, outlet::Answer::Kind::confirmed);
  EXPECT_TRUE(listener.WaitFor("baudgate/gate/bay/feeder/gone/history", "\"unit\":\"\""));
  EXPECT_THAT(listener.Last(std::string(kCurrent) + "/history"),
              HasSubstr("{\"value\":1.5,\"quality\":\"good\",\"reason\":\"\",\"time\":\"2026-09-21T"
                        "14:13:20.000Z\""));
  EXPECT_THAT(listener.Last(std::string(kCurrent) + "/history"), HasSubstr("1790000000000}"));
  MqttListener late(broker_.port(), "baudgate/gate/+/+/+/history");
  std::this_thread::sleep_for(200ms);
  EXPECT_TRUE(late.messages().empty());
  broker_.Freeze(true);
  session_->Send(PortionOf({"bay.feeder.current"}), std::ref(awaited));
  EXPECT_EQ(awaited.Wait().kind, outlet::Answer::Kind::retry);
  TroubleIs("has not confirmed messages");
  broker_.Freeze(false);
}

TEST_F(SessionTest, EmptiesRetainedMessagesOfPointsThatAreGone) {
  ASSERT_TRUE(broker_.Start());
  MqttListener listener(broker_.port(), "baudgate/#");
  const std::string old = "baudgate/gate/bay/feeder/old";
  listener.Publish(old, "{\"value\":7,\"quality\":\"good\"}", true);
  listener.Publish("baudgate/other/bay/feeder/old", "7", true);
  ASSERT_TRUE(listener.WaitFor("baudgate/other/bay/feeder/old", "7"));
  config_.mqtt.values = config::Mqtt::Values::history;
  config_.history.points = {{.device = 0, .point = 0}, {.device = 0, .point = 1}};
  StartSession();
  const auto emptied = [&](const std::string& topic) {
    return MqttListener::Wait([&] {
      const auto payloads = listener.Payloads(topic);
      return !payloads.empty() && payloads.back().empty();
    });
  };
  EXPECT_TRUE(emptied(old)) << "of an earlier run";
  EXPECT_TRUE(listener.WaitFor(kStatus, "online"));
  EXPECT_TRUE(listener.WaitFor(kCurrent, "quality"));
  EXPECT_TRUE(listener.Payloads("baudgate/gate/bay/feeder/text").empty()) << "not in the history";
  config_.history.points.pop_back();
  session_->Configure(std::make_shared<const config::Config>(config_));
  EXPECT_TRUE(emptied("baudgate/gate/bay/feeder/setting")) << "after a reload";
  EXPECT_EQ(listener.Last("baudgate/other/bay/feeder/old"), "7");
}

TEST_F(SessionTest, DescribesItsPointsToHomeAssistantAndForgetsOldOnes) {
  ASSERT_TRUE(broker_.Start());
  MqttListener listener(broker_.port(), "homeassistant/#");
  const std::string old = "homeassistant/sensor/gate/feeder--old/config";
  const std::string foreign = "homeassistant/sensor/gate/temperature/config";
  listener.Publish(old, R"({"unique_id":"baudgate--gate--feeder--old"})", true);
  listener.Publish(foreign, R"({"unique_id":"esp-7"})", true);
  ASSERT_TRUE(listener.WaitFor(foreign, "esp"));
  config_.mqtt.homeassistant = true;
  StartSession();
  const std::string current = "homeassistant/sensor/gate/feeder--current/config";
  EXPECT_TRUE(listener.WaitFor(current, kCurrent));
  EXPECT_TRUE(listener.WaitFor("homeassistant/number/gate/feeder--setting/config", "/set"));
  EXPECT_TRUE(MqttListener::Wait([&] { return listener.Payloads(old).size() == 2; }));
  EXPECT_EQ(listener.Last(old), "");
  config::Config next = config_;
  next.mqtt.values = config::Mqtt::Values::history;
  next.history.points = {{.device = 0, .point = 0}};
  session_->Configure(std::make_shared<const config::Config>(next));
  EXPECT_TRUE(MqttListener::Wait([&] {
    return listener.Payloads("homeassistant/number/gate/feeder--setting/config").size() == 1 ||
           listener.Last("homeassistant/number/gate/feeder--setting/config").empty();
  }));
  EXPECT_EQ(listener.Payloads(foreign).size(), 1U);
}

TEST_F(SessionTest, CarriesOutCommandsAndRefusesRetainedOnes) {
  ASSERT_TRUE(broker_.Start());
  MqttListener listener(broker_.port(), "baudgate/gate/+/+/+/result");
  const std::string setting = "baudgate/gate/bay/feeder/setting";
  listener.Publish(setting + "/set", "39", true);
  std::this_thread::sleep_for(100ms);
  StartSession();
  EXPECT_TRUE(listener.WaitFor(setting + "/result", "retained"));
  listener.Publish(setting + "/set", "38", true);
  EXPECT_TRUE(
      MqttListener::Wait([&] { return listener.Payloads(setting + "/result").size() == 2; }));
  EXPECT_THAT(listener.Last(setting + "/result"), HasSubstr("retained"))
      << "also while the gateway is connected";
  listener.Publish(setting + "/set", "41");
  EXPECT_TRUE(listener.WaitFor(setting + "/result", "40"));
  listener.Publish("baudgate/gate/bay/feeder/nothing/set", "1");
  EXPECT_TRUE(listener.WaitFor("baudgate/gate/bay/feeder/nothing/result", "no point"));
  listener.Publish(setting + "/set", "12.5");
  EXPECT_TRUE(MqttListener::Wait([&] { return session_->state().commands == 5; }));
  StopSession();
  ASSERT_EQ(sink_.commands.size(), 1U);
  EXPECT_EQ(ToDouble(sink_.commands[0].writes()[0].raw), 12.5);
}

TEST_F(SessionTest, SaysThatNobodyListensAndThatNobodyAnswers) {
  config_.mqtt.brokers = {{{"127.0.0.1", 1}, false}};
  StartSession();
  TroubleIs("the broker mqtt://127.0.0.1:1 cannot be reached");
  StopSession();
  // A socket that accepts (by its backlog) and never answers.
  const int silent = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(at);
  ASSERT_EQ(::bind(silent, reinterpret_cast<sockaddr*>(&at), size), 0);
  ASSERT_EQ(::listen(silent, 5), 0);
  ::getsockname(silent, reinterpret_cast<sockaddr*>(&at), &size);
  config_.mqtt.brokers = {{{"127.0.0.1", ntohs(at.sin_port)}, false}};
  StartSession();
  TroubleIs("has not answered");
  const Instant begin = ReadClocks().instant;
  StopSession();
  EXPECT_LT(ReadClocks().instant - begin, 2s);
  ::close(silent);
}

/// A broker with TLS, a user with a password, and a topic that may not be written.
class GuardedBrokerTest : public SessionTest {
 protected:
  GuardedBrokerTest()
      : SessionTest(
            "allow_anonymous false\npassword_file DIR/passwords\nacl_file DIR/acl\n"
            "cafile DIR/ca.pem\ncertfile DIR/server.pem\nkeyfile DIR/server.key\n") {
    const Now now = ReadClocks();
    const pki::Validity validity{now.wall - 24h, now.wall + 24h * 100};
    const auto authority = *pki::MakeAuthority("Test", validity);
    const auto server = *pki::IssueServer(authority, {"localhost"}, validity);
    const auto other = *pki::MakeAuthority("Other", validity);
    broker_.Write("ca.pem", authority.certificate);
    broker_.Write("server.pem", server.certificate);
    broker_.Write("server.key", server.key);
    broker_.Write("other.pem", other.certificate);
    broker_.Write("acl",
                  "user gate\ntopic readwrite baudgate/gate/#\ntopic deny "
                  "baudgate/gate/bay/feeder/current\ntopic deny "
                  "baudgate/gate/bay/feeder/secret/history\n");
    broker_.Write("passwords", "gate:secret\n");
    const std::string file = (broker_.folder() / "passwords").string();
    EXPECT_EQ(std::system(("mosquitto_passwd -U " + file).c_str()), 0);
    Password("secret");
    config_.mqtt.brokers = {{{"localhost", broker_.port()}, true}};
    config_.mqtt.tls.authorities = broker_.folder() / "ca.pem";
    config_.mqtt.user = "gate";
    config_.mqtt.password_file = broker_.folder() / "password";
  }
  void Password(const std::string& text) {
    broker_.Write("password", text + "\n");
    ::chmod((broker_.folder() / "password").c_str(), 0600);
  }
};

TEST_F(GuardedBrokerTest, SaysWhyTheBrokerIsNotUsedOrATopicNotAccepted) {
  ASSERT_TRUE(broker_.Start());
  StartSession();
  EXPECT_TRUE(MqttListener::Wait([&] { return !session_->state().refused.empty(); }));
  EXPECT_THAT(session_->state().refused, HasSubstr(kCurrent));
  EXPECT_THAT(session_->state().refused, HasSubstr("access rules"));
  EXPECT_EQ(session_->state().trouble, "");
  Awaited awaited;
  EXPECT_TRUE(MqttListener::Wait([&] { return session_.connected(); }));
  session_->Send(PortionOf({"bay.feeder.setting", "bay.feeder.secret", "bay.feeder.text"}),
                 std::ref(awaited));
  const auto answer = awaited.Wait();
  EXPECT_EQ(answer.kind, outlet::Answer::Kind::refused);
  EXPECT_THAT(answer.refused, ElementsAre(1));
  // If nothing was permitted yet, the access rules may be wrong: nothing is put aside.
  StopSession();
  StartSession();
  EXPECT_TRUE(MqttListener::Wait([&] { return session_.connected(); }));
  Awaited later;
  session_->Send(PortionOf({"bay.feeder.secret"}), std::ref(later));
  EXPECT_EQ(later.Wait().kind, outlet::Answer::Kind::retry);
  StopSession();

  config_.mqtt.tls.authorities = broker_.folder() / "other.pem";
  StartSession();
  TroubleIs("has a certificate that the authority of");
  StopSession();
  config_.mqtt.tls.authorities = broker_.folder() / "ca.pem";
  config_.mqtt.brokers[0].at.host = "127.0.0.1";
  StartSession();
  TroubleIs("for another name");
  StopSession();
  config_.mqtt.brokers[0].at.host = "localhost";
  Password("wrong");
  StartSession();
  TroubleIs("user or password is wrong");
  StopSession();
  ::chmod((broker_.folder() / "password").c_str(), 0644);
  StartSession();
  TroubleIs("chmod 0600");
}

/// A broker of the test that answers to the first packet with bytes of its own.
class RudeBroker {
 public:
  RudeBroker() : listening_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listening_, reinterpret_cast<sockaddr*>(&at), sizeof(at)), 0);
    EXPECT_EQ(::listen(listening_, 1), 0);
    socklen_t size = sizeof(at);
    ::getsockname(listening_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
  }
  ~RudeBroker() {
    ::close(connected_);
    ::close(listening_);
  }
  std::uint16_t port() const { return port_; }
  /// Accepts the client, and answers as soon as its first packet is there.
  void Look(std::string_view answer) {
    if (connected_ < 0) connected_ = ::accept4(listening_, nullptr, nullptr, SOCK_NONBLOCK);
    char packet[512];
    if (connected_ < 0 || ::recv(connected_, packet, sizeof(packet), 0) <= 0) return;
    EXPECT_GT(::send(connected_, answer.data(), answer.size(), MSG_NOSIGNAL), 0);
  }

 private:
  int listening_;
  int connected_ = -1;
  std::uint16_t port_ = 0;
};

// libmosquitto 2.0.11 ends the process at the first four of these.
TEST(Client, BytesThatAreNotMqttEndOnlyTheConnection) {
  const std::string accepted("\x20\x03\x00\x00\x00", 5);
  for (const std::string& answer : {std::string("\x20\x05\x00\x00\x02\x7f\x01", 7),
                                    accepted + std::string("\x40\x06\x00\x01\x00\x02\x7f\x01", 8),
                                    accepted + std::string("\x30\x06\x00\x01\x61\x02\x7f\x01", 8),
                                    accepted + std::string("\xe0\x04\x00\x02\x7f\x01", 6),
                                    accepted + "HTTP/1.1 400 Bad\r\n" + std::string(300, 'x'),
                                    "SSH-2.0-x\r\n" + std::string(300, 'x')}) {
    RudeBroker broker;
    const config::Config config = testing::GatewayConfig(broker.port());
    Client client(config.mqtt, {[] {
                                  return Client::Will{"status", "offline", true};
                                },
                                [] {}, [] {}, [](const Message&) {},
                                [](const std::string&, const std::string&) {}});
    for (int round = 0; round < 1000 && client.trouble().empty(); ++round) {
      client.Run(ReadClocks().instant + 5ms);
      broker.Look(answer);
    }
    EXPECT_THAT(client.trouble(), HasSubstr("the broker mqtt://127.0.0.1:")) << answer;
  }
}

}  // namespace
}  // namespace baudgate::mqtt
