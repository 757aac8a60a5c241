// SPDX-License-Identifier: Apache-2.0
#include "map_builder/request_answers.h"

#include <algorithm>
#include <format>
#include <string>

#include "map/stream_encoding.h"
#include "map_builder/request_rules.h"
#include "map_builder/web_files.h"

namespace ignis {
namespace {

namespace http = boost::beast::http;

constexpr char kStreamPath[] = "/ws/lio_map";
constexpr char kStatusPath[] = "/api/status";

HttpResponse make_response(http::status status, std::string_view type, std::string_view body) {
  HttpResponse response(status, 11);
  response.set(http::field::server, "ignis map_builder");
  response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-cache");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Content-Security-Policy", "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'");
  response.body() = body;
  response.prepare_payload();
  return response;
}

}  // namespace

HttpResponse refusal(http::status status, std::string_view sentence) {
  return make_response(status, "text/plain; charset=utf-8", std::string(sentence) + '\n');
}

HttpResponse page_or_refusal(const HttpRequest& request, std::string_view allowed_origin,
                             std::string_view status_json) {
  if (!host_is_allowed(request[http::field::host], allowed_origin)) {
    return refusal(http::status::forbidden, "open the view by IP address or as localhost");
  }
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    return refusal(http::status::method_not_allowed, "only GET is served");
  }
  if (request.target() == kStatusPath) return make_response(http::status::ok, "application/json", status_json);
  if (request.target() == kStreamPath) return refusal(http::status::upgrade_required, "this is a WebSocket");
  const std::string_view target = request.target().substr(0, request.target().find('?'));
  const auto files = web_files();
  const auto file = std::ranges::find(files, target, &WebFile::path);
  if (file == files.end()) return refusal(http::status::not_found, "no such page");
  return make_response(http::status::ok, file->content_type, file->content);
}

std::optional<HttpResponse> refusal_of_stream(const HttpRequest& request, std::string_view allowed_origin) {
  const std::string_view host = request[http::field::host];
  if (request.target() != kStreamPath) return refusal(http::status::not_found, "no such stream");
  if (!host_is_allowed(host, allowed_origin) ||
      !origin_is_allowed(request[http::field::origin], host, allowed_origin)) {
    return refusal(http::status::forbidden, "this origin may not open the stream; see hmi.allowed_origin");
  }
  if (!offers_protocol(request[http::field::sec_websocket_protocol], kStreamProtocol)) {
    return refusal(http::status::bad_request, std::format("offer the subprotocol {}", kStreamProtocol));
  }
  return std::nullopt;
}

}  // namespace ignis
