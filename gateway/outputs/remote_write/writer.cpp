// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/remote_write/writer.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/base/secret_file.h"

namespace baudgate::remote_write {
namespace {

using outlet::Answer;
using Kind = outlet::Answer::Kind;

constexpr std::size_t kLongestText = 200;
constexpr Duration kPatience = 2s;

/// Returns the first line of an answer, without characters that do not belong into a log.
std::string FirstLine(std::string_view text) {
  std::string line(text.substr(0, std::min(text.find('\n'), kLongestText)));
  std::ranges::replace_if(
      line, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, ' ');
  return line;
}

bool Contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

bool IsTooOld(const HttpAnswer& answer) {
  return answer.status == 400 &&
         (Contains(answer.text, "out of bounds") || Contains(answer.text, "too old"));
}

/// The receiver has a later value of the series, or another value with the same time.
bool IsKnown(const HttpAnswer& answer) {
  return answer.status == 400 &&
         (Contains(answer.text, "out of order") || Contains(answer.text, "duplicate sample"));
}

}  // namespace

Answer Judge(const HttpAnswer& answer, const outlet::Portion& portion, const std::string& url) {
  if (answer.status >= 200 && answer.status < 300) return {};
  if (portion.again && portion.values.size() == 1 && IsKnown(answer)) return {};
  const auto retry = [&](std::string why) {
    return Answer{.kind = Kind::retry, .why = std::move(why), .wait = answer.retry_after};
  };
  const std::string said =
      fmt::format("{}{}{}", answer.status, answer.text.empty() ? "" : ": ", answer.text);
  switch (answer.status) {
    case 0:
      return retry(answer.text);
    case 400:
    case 413:
    case 422:
      return {.kind = Kind::refused, .why = fmt::format("{} refuses values: {}", url, said)};
    case 401:
    case 403:
      return retry(fmt::format("{} does not accept the user or the password of remote_write ({})",
                               url, said));
    case 404:
    case 405:
      return retry(
          fmt::format("nothing takes remote write at {} ({}); correct url, or switch the "
                      "receiver of the database on",
                      url, said));
    case 429:
      return retry(fmt::format("{} asks for fewer requests ({})", url, said));
    default:
      break;
  }
  if (answer.status >= 500) return retry(fmt::format("{} cannot store values ({})", url, said));
  if (answer.status < 400) {
    return retry(
        fmt::format("{} sends the gateway to another address ({}); write that address "
                    "as url",
                    url, said));
  }
  return retry(fmt::format("{} does not accept the request ({})", url, said));
}

namespace {

/// Returns why no answer came.
std::string TroubleOf(CURLcode code, const std::string& details, const std::string& url) {
  switch (code) {
    case CURLE_COULDNT_RESOLVE_HOST:
      return fmt::format("the name of the host of {} cannot be resolved", url);
    case CURLE_OPERATION_TIMEDOUT:
      return fmt::format("{} does not answer in time", url);
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
    case CURLE_SSL_ISSUER_ERROR:
      return fmt::format("the certificate of {} is not accepted: {}", url, details);
    default:
      return fmt::format("{} cannot be reached: {}", url,
                         details.empty() ? curl_easy_strerror(code) : details);
  }
}

std::size_t OnBody(char* bytes, std::size_t size, std::size_t count, void* to) {
  auto& text = *static_cast<std::string*>(to);
  if (text.size() < kLongestText) text.append(bytes, size * count);
  return size * count;
}

}  // namespace

// `RemoteWriter::Work` belongs to the thread, which can outlive the writer.
class RemoteWriter::Work {
 public:
  explicit Work(config::RemoteWrite settings) : settings_(std::move(settings)) {
    static std::once_flag once;
    std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
  }

  void SetNames(std::shared_ptr<const SeriesNames> names) {
    const MutexLock lock(mutex_);
    names_ = std::move(names);
  }
  void Put(outlet::Portion portion, std::function<void(Answer)> done) {
    const MutexLock lock(mutex_);
    waiting_ = Job{std::move(portion), std::move(done)};
  }
  void Stop() { stops_ = true; }
  void WaitForEnd(Duration patience) {
    const Instant until = ReadClocks().instant + patience;
    MutexLock lock(mutex_);
    while (!ended_ && lock.WaitUntil(end_, until)) {
    }
  }

  Instant Round(bool last) {
    std::optional<Job> job;
    std::shared_ptr<const SeriesNames> names;
    {
      const MutexLock lock(mutex_);
      job = std::exchange(waiting_, std::nullopt);
      names = names_;
    }
    if (job && names && !last) job->done(Write(*names, job->portion));
    if (!last) return kWhenWoken;
    curl_.reset();
    const MutexLock lock(mutex_);
    ended_ = true;
    end_.notify_all();
    return kWhenWoken;
  }

 private:
  struct Job {
    outlet::Portion portion;
    std::function<void(Answer)> done;
  };
  struct Closer {
    void operator()(CURL* handle) const { curl_easy_cleanup(handle); }
    void operator()(curl_slist* list) const { curl_slist_free_all(list); }
  };

  Answer Write(const SeriesNames& names, const outlet::Portion& portion) {
    const Instant now = ReadClocks().instant;
    if (now - too_old_at_ > kTooOldFor) too_old_ = 0;
    Answer refused{.kind = Kind::refused, .why = too_old_why_};
    for (std::size_t i = 0; i < portion.values.size(); ++i) {
      if (portion.values[i].entry.time <= too_old_) refused.refused.push_back(i);
    }
    if (!refused.refused.empty()) return refused;
    const WriteRequest request = Encode(names, portion.values);
    if (request.body.empty()) return {};
    const HttpAnswer answer = Post(request.body);
    Answer its = Judge(answer, portion, settings_.url);
    if (its.kind == Kind::refused && portion.values.size() == 1 && IsTooOld(answer)) {
      too_old_ = portion.values[0].entry.time;
      too_old_at_ = now;
      too_old_why_ = its.why;
    }
    return its;
  }

  HttpAnswer Post(const std::string& body) {
    if (!settings_.user.empty() && password_.empty()) {
      auto password = ReadSecretFile("the password file", settings_.password_file);
      if (!password) return {.text = password.error()};
      password_ = std::move(*password);
    }
    if (!curl_) curl_.reset(curl_easy_init());
    CURL* const curl = curl_.get();
    if (curl == nullptr) return {.text = "not enough memory for a request"};
    std::array<char, CURL_ERROR_SIZE> details{};
    std::string text;
    std::unique_ptr<curl_slist, Closer> headers;
    for (const char* header :
         {"Content-Type: application/x-protobuf", "Content-Encoding: snappy",
          "X-Prometheus-Remote-Write-Version: 0.1.0", "User-Agent: baudgate", "Expect:"}) {
      headers.reset(curl_slist_append(headers.release(), header));
    }
    // The connection stays open over a reset of the options.
    curl_easy_reset(curl);
    const auto milliseconds = [](Duration time) { return static_cast<long>(time / 1ms); };
    curl_easy_setopt(curl, CURLOPT_URL, settings_.url.c_str());
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, milliseconds(kConnectTimeout));
    curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, milliseconds(kTimeout));
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
    curl_easy_setopt(curl, CURLOPT_POSTFIELDS, body.data());
    curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE, static_cast<long>(body.size()));
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, &OnBody);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, &text);
    curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, details.data());
    curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(curl, CURLOPT_XFERINFODATA, this);
    curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, &Work::OnProgress);
    if (!settings_.user.empty()) {
      curl_easy_setopt(curl, CURLOPT_HTTPAUTH, CURLAUTH_BASIC);
      curl_easy_setopt(curl, CURLOPT_USERNAME, settings_.user.c_str());
      curl_easy_setopt(curl, CURLOPT_PASSWORD, password_.c_str());
    }
    if (!settings_.ca.empty()) {
      curl_easy_setopt(curl, CURLOPT_CAINFO, settings_.ca.c_str());
      curl_easy_setopt(curl, CURLOPT_CAPATH, nullptr);
    }
    const CURLcode code = curl_easy_perform(curl);
    if (code != CURLE_OK) {
      // The next request looks up everything again: name, connection, certificate.
      curl_.reset();
      return {.text = TroubleOf(code, FirstLine(details.data()), settings_.url)};
    }
    HttpAnswer answer{.text = FirstLine(text)};
    curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &answer.status);
    curl_off_t seconds = 0;
    curl_easy_getinfo(curl, CURLINFO_RETRY_AFTER, &seconds);
    if (seconds > 0) answer.retry_after = std::chrono::seconds(std::min<curl_off_t>(seconds, 3600));
    // The password may have been changed since it was read.
    if (answer.status == 401 || answer.status == 403) password_.clear();
    return answer;
  }

  static int OnProgress(void* self, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    return static_cast<Work*>(self)->stops_ ? 1 : 0;
  }

  const config::RemoteWrite settings_;
  // Only the thread uses these.
  std::unique_ptr<CURL, Closer> curl_;
  std::string password_;
  history::Millis too_old_ = 0;
  Instant too_old_at_{};
  std::string too_old_why_;

  std::atomic<bool> stops_ = false;
  Mutex mutex_;
  std::shared_ptr<const SeriesNames> names_ BAUDGATE_GUARDED_BY(mutex_);
  std::optional<Job> waiting_ BAUDGATE_GUARDED_BY(mutex_);
  bool ended_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::condition_variable end_;
};

RemoteWriter::RemoteWriter(config::RemoteWrite settings)
    : work_(std::make_shared<Work>(std::move(settings))),
      worker_("remote write", [work = work_](bool last) { return work->Round(last); }) {
  worker_.Start();
}

RemoteWriter::~RemoteWriter() {
  work_->Stop();
  worker_.Leave();
  work_->WaitForEnd(kPatience);
}

void RemoteWriter::SetNames(std::shared_ptr<const SeriesNames> names) {
  work_->SetNames(std::move(names));
}

void RemoteWriter::Send(outlet::Portion portion, std::function<void(Answer)> done) {
  work_->Put(std::move(portion), std::move(done));
  worker_.Wake();
}

}  // namespace baudgate::remote_write
