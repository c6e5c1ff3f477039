// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/mhd_answer.h"

#include <array>
#include <string>
#include <utility>

namespace baudgate::web {
namespace {

constexpr std::size_t kStreamBlock = 16 * 1024;

using Kept = std::shared_ptr<Exchange>;

ssize_t ReadStream(void* kept, std::uint64_t, char* into, std::size_t most) {
  const std::ptrdiff_t got = (*static_cast<Kept*>(kept))->Read({into, most});
  return got == Stream::kEnd ? MHD_CONTENT_READER_END_OF_STREAM : got;
}
void FreeStream(void* kept) { delete static_cast<Kept*>(kept); }

/// Owns the bytes of an answer until they have been sent.
struct Owner {
  Owner(const Response& response, BytesUnderWay bytes)
      : held(response.owner), size(response.body.size()), all(std::move(bytes)) {
    *all += size;
  }
  ~Owner() { *all -= size; }
  Owner(const Owner&) = delete;
  Owner& operator=(const Owner&) = delete;

  const std::shared_ptr<const void> held;
  const std::size_t size;
  const BytesUnderWay all;
};
void FreeOwner(void* owner) { delete static_cast<Owner*>(owner); }

MHD_Response* MakeBody(const Response& response, const BytesUnderWay& bytes_sent) {
  void* const bytes = const_cast<char*>(response.body.data());
  if (!response.owner) {
    return MHD_create_response_from_buffer(response.body.size(), bytes, MHD_RESPMEM_PERSISTENT);
  }
  auto owner = std::make_unique<Owner>(response, bytes_sent);
  MHD_Response* const made = MHD_create_response_from_buffer_with_free_callback_cls(
      response.body.size(), bytes, FreeOwner, owner.get());
  if (made != nullptr) owner.release();
  return made;
}

MHD_Response* Make(const Response& response, const Kept& exchange,
                   const BytesUnderWay& bytes_sent) {
  if (!response.stream) return MakeBody(response, bytes_sent);
  exchange->Attach(response.stream);
  auto kept = std::make_unique<Kept>(exchange);
  MHD_Response* const made = MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, kStreamBlock,
                                                               ReadStream, kept.get(), FreeStream);
  if (made != nullptr) kept.release();
  return made;
}

/// On every answer. Nothing of another machine is loaded, and nothing of ours goes into a frame.
constexpr std::array<std::pair<const char*, const char*>, 6> kHeaders = {{
    {"Content-Security-Policy",
     "default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'; "
     "object-src 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
}};

}  // namespace

MHD_Result Send(MHD_Connection* connection, const Response& response, const Kept& exchange,
                const BytesUnderWay& bytes_sent, bool last) {
  MHD_Response* const made = Make(response, exchange, bytes_sent);
  if (made == nullptr) return MHD_NO;
  for (const auto& [name, value] : kHeaders) MHD_add_response_header(made, name, value);
  if (!response.type.empty()) {
    MHD_add_response_header(made, "Content-Type", response.type.c_str());
  }
  bool cached = false;
  for (const auto& [name, value] : response.headers) {
    MHD_add_response_header(made, name.c_str(), value.c_str());
    cached = cached || name == "Cache-Control";
  }
  if (!cached) MHD_add_response_header(made, "Cache-Control", "no-store");
  if (last) MHD_add_response_header(made, "Connection", "close");
  const MHD_Result queued =
      MHD_queue_response(connection, static_cast<unsigned>(response.status), made);
  MHD_destroy_response(made);
  return queued;
}

}  // namespace baudgate::web
