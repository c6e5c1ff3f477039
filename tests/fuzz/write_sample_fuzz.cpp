// Fuzzes samples on baudgate/write: each is refused, or executed at most once. Input: several
// requests, each behind its length.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "gateway/bus/writes/request_book.h"
#include "gateway/outputs/dds/link/link_message.h"
#include "gateway/outputs/dds/published_types.h"
#include "gateway/outputs/dds/writes/write_service.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

using namespace dds;
using What = bus::RequestBook::Verdict::What;

void CheckForm(const RequestSample& request) {
  WriteArrival arrival;
  arrival.request = request;
  const Bytes packet = EncodeRequest(arrival);
  const auto message = ParseLink(packet);
  Require(message.ok(), "a request that was read can be sent on");
  const auto back = DecodeRequest(message->body);
  Require(back.ok(), "what was sent on can be read");
  Require(EncodeRequest(*back) == packet, "and says the same");
}

void CheckValue(const RequestSample& request) {
  using config::Type;
  for (const Type type : {Type::boolean, Type::uint16, Type::int64, Type::uint64, Type::float32,
                          Type::float64, Type::string}) {
    config::Point point;
    point.name = "p";
    point.type = type;
    point.text_length = 16;
    const auto value = ValueOf(point, request);
    if (!value.ok()) {
      Require(!value.error().empty(), "a refused value has a reason");
      continue;
    }
    if (const auto* text = std::get_if<std::string>(&*value)) {
      Require(text->size() <= 16, "a text is as long as its point at most");
    } else {
      Require(std::isfinite(ToDouble(*value)), "a number is one");
    }
  }
}

class Requests {
 public:
  void Take(const RequestSample& request) {
    now_ += 1ms;
    const auto verdict = book_.Begin(IdOf(request), now_);
    Require(book_.clients() <= bus::RequestBook::kClients, "clients are bounded");
    if (verdict.what != What::fresh) return;
    const auto key = std::pair(request.client, request.seq);
    Require(done_.insert(key).second, "nothing is carried out twice");
    if (request.seq % 3 != 0) book_.End(request.client, request.seq, {});
  }

 private:
  bus::RequestBook book_;
  std::set<std::pair<std::string, std::uint64_t>> done_;
  Instant now_{1h};
};

void FuzzWriteSample(View input) {
  Requests requests;
  while (input.size() >= 2) {
    const std::size_t length = std::min<std::size_t>(input[0] + 256U * input[1], input.size() - 2);
    const View sample = input.subspan(2, length);
    const Bytes bytes(sample.begin(), sample.end());
    input = input.subspan(2 + length);
    RequestSample request;
    if (!Decode(bytes, request)) continue;
    Require(request.client.size() <= kMaxKey && request.text.size() <= kMaxText,
            "texts are bounded");
    CheckForm(request);
    CheckValue(request);
    requests.Take(request);
  }
}

const Registered kWriteSample("write_sample", FuzzWriteSample);

}  // namespace
}  // namespace baudgate::fuzz
