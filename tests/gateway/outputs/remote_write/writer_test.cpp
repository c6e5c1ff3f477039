// Tests of remote write without a real receiver: the bytes of a request, the meaning of each
// answer, and requests to a small HTTP server.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/remote_write/writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <snappy-c.h>

#include <asio.hpp>
#include <bit>
#include <fstream>
#include <future>
#include <mutex>
#include <thread>

namespace baudgate::remote_write {
namespace {

using history::Entry;
using outlet::Answer;
using outlet::KeptValue;
using outlet::Portion;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A decoder of Protocol Buffers that is independent of the encoder: fields by number, without a
// scheme.
struct Fields {
  explicit Fields(std::string_view bytes) {
    const auto number = [&bytes] {
      std::uint64_t value = 0;
      for (unsigned shift = 0; !bytes.empty(); shift += 7) {
        const auto byte = static_cast<std::uint8_t>(bytes[0]);
        bytes.remove_prefix(1);
        value |= std::uint64_t{byte & 0x7FU} << shift;
        if (byte < 0x80) break;
      }
      return value;
    };
    while (!bytes.empty()) {
      const std::uint64_t key = number();
      const std::size_t field = key >> 3U;
      if ((key & 7U) == 0) {
        numbers[field] = number();
      } else if ((key & 7U) == 1) {
        for (unsigned i = 8; i-- > 0;) {
          numbers[field] = numbers[field] << 8U | static_cast<std::uint8_t>(bytes[i]);
        }
        bytes.remove_prefix(8);
      } else {
        const std::uint64_t size = number();
        texts[field].emplace_back(bytes.substr(0, size));
        bytes.remove_prefix(size);
      }
    }
  }
  std::map<std::size_t, std::vector<std::string>> texts;
  std::map<std::size_t, std::uint64_t> numbers;
};

std::string Uncompressed(const std::string& body) {
  std::size_t size = 0;
  EXPECT_EQ(snappy_uncompressed_length(body.data(), body.size(), &size), SNAPPY_OK);
  std::string text(size, '\0');
  EXPECT_EQ(snappy_uncompress(body.data(), body.size(), text.data(), &size), SNAPPY_OK);
  return text;
}

/// Returns the series of a request: "a=1,b=2: 10@5 …".
std::vector<std::string> SeriesIn(const std::string& body) {
  std::vector<std::string> all;
  const auto request = Fields(Uncompressed(body)).texts;
  for (const std::string& bytes :
       request.count(1) > 0 ? request.at(1) : std::vector<std::string>()) {
    Fields series(bytes);
    std::string text;
    for (const std::string& label : series.texts[1]) {
      Fields pair(label);
      text += (text.empty() ? "" : ",") + pair.texts[1][0] + "=" + pair.texts[2][0];
    }
    text += ":";
    for (const std::string& bytes_of_sample : series.texts[2]) {
      Fields sample(bytes_of_sample);
      const std::uint64_t bits = sample.numbers[1];
      text += " " + (bits == kStale ? "stale" : ToText(Value(std::bit_cast<double>(bits)))) + "@" +
              std::to_string(sample.numbers[2]);
    }
    all.push_back(text);
  }
  return all;
}

config::Config Plant() {
  config::Config config;
  config.name = "gate";
  config.remote_write.labels = {{"site", "north"}};
  config::Line line;
  line.name = "bay";
  config::Device device;
  device.name = "f1";
  for (const auto& [name, type, unit] :
       {std::tuple("a", config::Type::float32, "A"), std::tuple("on", config::Type::boolean, ""),
        std::tuple("serial", config::Type::string, "")}) {
    config::Point point;
    point.name = name;
    point.type = type;
    point.unit = unit;
    device.points.push_back(point);
  }
  line.devices.push_back(device);
  config.lines.push_back(line);
  return config;
}

KeptValue At(const std::string& point, history::Millis time, Value value,
             Quality quality = Quality::good) {
  return {point, {time, std::move(value), quality}, time};
}

TEST(RemoteWriteSeries, AreThoseOfMetricsWithTheGatewayAndLabels) {
  const SeriesNames names(Plant());
  const std::vector<KeptValue> values = {
      At("bay.f1.a", 1000, 1.5),
      At("bay.f1.a", 2000, {}, Quality::bad_communication),
      At("bay.f1.a", 3000, 2.5, Quality::uncertain),
      At("bay.f1.gone", 1000, std::int64_t{-7}),
      At("bay.f1.on", 1000, true),
      At("bay.f1.serial", 1000, std::string("x")),
      At("bay.f1.serial", 2000, {}, Quality::bad_communication),
  };
  const WriteRequest request = Encode(names, values);
  EXPECT_EQ(request.samples, 5U);
  EXPECT_THAT(
      SeriesIn(request.body),
      ElementsAre("__name__=baudgate_point_value,device=f1,gateway=gate,line=bay,point=a,site="
                  "north,unit=A: 1.5@1000 stale@2000 stale@3000",
                  "__name__=baudgate_point_value,device=f1,gateway=gate,line=bay,point=gone,site="
                  "north: -7@1000",
                  "__name__=baudgate_point_value,device=f1,gateway=gate,line=bay,point=on,site="
                  "north: 1@1000"));
  EXPECT_THAT(Encode(names, std::span(values).subspan(5)).body, IsEmpty());
}

TEST(RemoteWriteAnswers, AreToldApart) {
  const Portion one{{At("bay.f1.a", 1, 1.0)}, false};
  const Portion two{{At("bay.f1.a", 1, 1.0), At("bay.f1.a", 2, 1.0)}, false};
  const Portion again{{At("bay.f1.a", 1, 1.0)}, true};
  struct Case {
    HttpAnswer answer;
    const Portion& portion;
    Answer::Kind kind;
    std::string why;
  };
  const std::vector<Case> cases = {
      {{200}, two, Answer::Kind::confirmed, ""},
      {{204}, two, Answer::Kind::confirmed, ""},
      {{0, "the name cannot be resolved"}, two, Answer::Kind::retry, "resolved"},
      {{302}, two, Answer::Kind::retry, "another address"},
      {{400, "out of order sample"}, two, Answer::Kind::refused, "out of order"},
      {{400, "out of order sample"}, one, Answer::Kind::refused, "out of order"},
      {{400, "out of order sample"}, again, Answer::Kind::confirmed, ""},
      {{400, "label limit"}, again, Answer::Kind::refused, "label limit"},
      {{401}, two, Answer::Kind::retry, "password"},
      {{403}, two, Answer::Kind::retry, "password"},
      {{404}, two, Answer::Kind::retry, "correct url"},
      {{413}, two, Answer::Kind::refused, "413"},
      {{418}, two, Answer::Kind::retry, "418"},
      {{429, "slow down", 7s}, two, Answer::Kind::retry, "fewer requests"},
      {{500, "disk full"}, two, Answer::Kind::retry, "disk full"},
      {{503, "", 9s}, two, Answer::Kind::retry, "cannot store"},
  };
  for (const Case& its : cases) {
    const Answer answer = Judge(its.answer, its.portion, "http://x");
    EXPECT_EQ(answer.kind, its.kind) << its.answer.status << its.answer.text;
    EXPECT_THAT(answer.why, HasSubstr(its.why));
    EXPECT_EQ(answer.wait, its.answer.retry_after);
  }
}

/// Answers each request with the next of its answers, and stores the requests.
class HttpServer {
 public:
  explicit HttpServer(std::vector<std::string> answers)
      : answers_(std::move(answers)),
        acceptor_(context_, {asio::ip::make_address("127.0.0.1"), 0}),
        thread_([this] { Serve(); }) {}
  ~HttpServer() {
    std::error_code ignored;
    asio::ip::tcp::socket(context_).connect(acceptor_.local_endpoint(), ignored);
    thread_.join();
  }
  std::string url() const {
    return "http://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()) + "/write";
  }
  std::vector<std::string> requests() {
    const std::lock_guard lock(mutex_);
    return requests_;
  }

 private:
  void Serve() {
    for (const std::string& answer : answers_) {
      asio::ip::tcp::socket socket(context_);
      acceptor_.accept(socket);
      std::string request;
      std::error_code error;
      std::size_t head = asio::read_until(socket, asio::dynamic_buffer(request), "\r\n\r\n", error);
      if (error) continue;
      const std::size_t at = request.find("Content-Length: ");
      const std::size_t length = std::stoul(request.substr(at + 16));
      while (!error && request.size() < head + length) {
        std::array<char, 4096> bytes{};
        request.append(bytes.data(), socket.read_some(asio::buffer(bytes), error));
      }
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
      }
      if (answer == "silence") std::this_thread::sleep_for(3s);
      asio::write(socket, asio::buffer("HTTP/1.1 " + answer), error);
    }
  }

  const std::vector<std::string> answers_;
  std::mutex mutex_;
  std::vector<std::string> requests_;
  asio::io_context context_;
  asio::ip::tcp::acceptor acceptor_;
  std::thread thread_;
};

Answer SendTo(RemoteWriter& writer, Portion portion) {
  auto promise = std::make_shared<std::promise<Answer>>();
  auto answer = promise->get_future();
  writer.Send(std::move(portion), [promise](Answer its) { promise->set_value(std::move(its)); });
  if (answer.wait_for(10s) != std::future_status::ready) return {.why = "no answer"};
  return answer.get();
}

constexpr const char* kEnd = "\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

std::unique_ptr<RemoteWriter> WriterTo(const std::string& url, const std::string& password = {}) {
  config::RemoteWrite settings;
  settings.on = true;
  settings.url = url;
  if (!password.empty()) {
    settings.user = "gate";
    settings.password_file = password;
  }
  auto writer = std::make_unique<RemoteWriter>(settings);
  writer->SetNames(std::make_shared<SeriesNames>(Plant()));
  return writer;
}

TEST(RemoteWriter, SendsAsTheSpecificationSays) {
  const std::string file = ::testing::TempDir() + "remote_write.password";
  std::ofstream(file) << "secret\n";
  std::filesystem::permissions(file, std::filesystem::perms::owner_read);
  HttpServer server({"204 No Content\r\nConnection: close\r\n\r\n",
                     std::string("429 Busy\r\nRetry-After: 12") + kEnd});
  const auto writer = WriterTo(server.url(), file);
  const Portion portion{{At("bay.f1.a", 1000, 1.5)}, false};
  const Answer first = SendTo(*writer, portion);
  EXPECT_EQ(first.kind, Answer::Kind::confirmed) << first.why;
  const std::vector<std::string> requests = server.requests();
  ASSERT_THAT(requests, SizeIs(1));
  for (const char* part :
       {"POST /write HTTP/1.1\r\n", "Content-Type: application/x-protobuf\r\n",
        "Content-Encoding: snappy\r\n", "X-Prometheus-Remote-Write-Version: 0.1.0\r\n",
        "Authorization: Basic Z2F0ZTpzZWNyZXQ=\r\n"}) {
    EXPECT_THAT(requests[0], HasSubstr(part));
  }
  EXPECT_THAT(SeriesIn(requests[0].substr(requests[0].find("\r\n\r\n") + 4)), SizeIs(1));
  const Answer second = SendTo(*writer, portion);
  EXPECT_EQ(second.kind, Answer::Kind::retry);
  EXPECT_EQ(second.wait, 12s);
}

/// A receiver that takes only values of the last hour is not asked about each older value.
TEST(RemoteWriter, DoesNotSendWhatIsTooOld) {
  HttpServer server({std::string("400 Bad\r\nContent-Length: 13\r\nConnection: close\r\n\r\n"
                                 "out of bounds"),
                     std::string("200 OK") + kEnd});
  const auto writer = WriterTo(server.url());
  EXPECT_EQ(SendTo(*writer, {{At("bay.f1.a", 5000, 1.0)}, true}).kind, Answer::Kind::refused);
  const Answer mixed =
      SendTo(*writer, {{At("bay.f1.a", 6000, 1.0), At("bay.f1.on", 4000, true)}, false});
  EXPECT_THAT(mixed.refused, ElementsAre(1U));
  EXPECT_THAT(mixed.why, HasSubstr("out of bounds"));
  EXPECT_THAT(server.requests(), SizeIs(1));
  EXPECT_EQ(SendTo(*writer, {{At("bay.f1.a", 6000, 1.0)}, false}).kind, Answer::Kind::confirmed);
}

TEST(RemoteWriter, EndsInTimeWhileTheReceiverIsSilent) {
  HttpServer server({"silence"});
  auto writer = WriterTo(server.url());
  writer->Send({{At("bay.f1.a", 1000, 1.0)}, false}, [](const Answer&) {});
  while (server.requests().empty()) std::this_thread::sleep_for(5ms);
  const auto began = std::chrono::steady_clock::now();
  writer.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - began, 2500ms);
}

TEST(RemoteWriter, TellsWhyItCannotReadThePassword) {
  const auto writer = WriterTo("http://127.0.0.1:1/", "/nowhere/password");
  EXPECT_THAT(SendTo(*writer, {{At("bay.f1.a", 1000, 1.0)}, false}).why,
              HasSubstr("/nowhere/password"));
}

}  // namespace
}  // namespace baudgate::remote_write
