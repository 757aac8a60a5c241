// SPDX-License-Identifier: Apache-2.0
//
// Bytes that a client may send as an HTTP request, through the parser that the server uses, its rules of who may talk
// to it, and its answers. The rules are told once more here, from the other side. Each input is a target of its own as
// well: few bytes are a whole request.

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "map/stream_encoding.h"
#include "map_builder/request_answers.h"
#include "map_builder/request_rules.h"
#include "map_builder/web_files.h"
#include "require.h"

namespace ignis {
namespace {

constexpr WebFile kFiles[] = {{"/", "text/html", "the page"},
                              {"/view.js", "text/javascript", "its program"},
                              {"/icon.svg", "image/svg+xml", "its icon"}};

}  // namespace

/// In place of the table that is made of the bundled page.
std::span<const WebFile> web_files() { return kFiles; }

}  // namespace ignis

namespace {

using namespace ignis;
using fuzz::require;
namespace http = boost::beast::http;

constexpr char kStatus[] = "the status";

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// A host that is let in without a configured origin is localhost or an address: hexadecimal digits, and a scope such
/// as %eth0 behind an IPv6 address. Brackets that open are closed, and nothing but a port follows them.
void judge_host(std::string_view host) {
  if (!host_is_allowed(host, "")) return;
  const std::string name = lower(host);
  if (name == "localhost" || name.starts_with("localhost:")) return;
  std::size_t end = name.find(':');
  std::size_t begin = 0;
  if (name.starts_with('[')) {
    begin = 1;
    end = name.find(']');
    require(end != std::string::npos && (end + 1 == name.size() || name[end + 1] == ':'));
  }
  const std::string address = name.substr(begin, end == std::string::npos ? end : end - begin);
  require(address.find_first_not_of("0123456789abcdef.:") == std::string::npos || address.contains('%'));
}

/// An origin that is let in is none, or that of the page.
void judge_origin(std::string_view origin, std::string_view host) {
  if (!origin_is_allowed(origin, host, "")) return;
  require(origin.empty() || lower(origin) == "http://" + lower(host));
}

void judge_protocol(std::string_view header) {
  require(!offers_protocol(header, kStreamProtocol) || header.contains(kStreamProtocol));
}

/// Only what is listed is served, and only under its own name; everything else is 4xx.
void judge_answer(const HttpRequest& request, const HttpResponse& response) {
  const std::string_view target = request.target();
  if (response.result() != http::status::ok) {
    require(http::to_status_class(response.result()) == http::status_class::client_error);
  } else if (response.body() == kStatus) {
    require(target == "/api/status");
  } else {
    const auto file = std::ranges::find(kFiles, response.body(), &WebFile::content);
    require(file != std::end(kFiles) && target.substr(0, target.find('?')) == file->path);
  }
}

/// No byte of a request gets into an answer: those of one kind are equal, head and all, whoever asks for what.
void judge_bytes(const HttpResponse& response) {
  constexpr std::size_t kKinds = 11;  // three files, the status, seven refusals
  static std::map<std::string, std::string> seen;
  std::ostringstream written;
  written << response;
  const auto [known, is_new] = seen.try_emplace(response.body(), written.str());
  require(known->second == written.str() && seen.size() <= kKinds);
}

void judge_answers(const HttpRequest& request) {
  const HttpResponse page = page_or_refusal(request, "", kStatus);
  judge_answer(request, page);
  judge_bytes(page);
  const std::optional<HttpResponse> refused = refusal_of_stream(request, "");
  if (refused) {
    judge_bytes(*refused);
  } else {
    require(request.target() == "/ws/lio_map" && host_is_allowed(request[http::field::host], ""));
  }
}

/// A request for `target` that breaks no other rule.
HttpRequest request_for(std::string_view target) {
  HttpRequest request(http::verb::get, target, 11);
  request.set(http::field::host, "localhost:8080");
  request.set(http::field::sec_websocket_protocol, kStreamProtocol);
  return request;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  http::request_parser<http::empty_body> parser;
  parser.header_limit(8 * 1024);
  boost::beast::error_code error;
  parser.put(boost::asio::buffer(data, size), error);
  if (!error && parser.is_header_done()) {
    const auto& request = parser.get();
    judge_host(request[http::field::host]);
    judge_origin(request[http::field::origin], request[http::field::host]);
    judge_protocol(request[http::field::sec_websocket_protocol]);
    static_cast<void>(boost::beast::websocket::is_upgrade(request));
    judge_answers(request);
  }
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  judge_host(text);
  judge_origin(text, text.substr(0, size / 2));
  judge_protocol(text);
  judge_answers(request_for(text));
  return 0;
}
