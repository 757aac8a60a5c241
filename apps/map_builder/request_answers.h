// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

/// What the server answers to whole HTTP requests. All of it is a function of the request, the table of files and the
/// arguments, and no byte of a request ever stands in an answer.
namespace ignis {

using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;
using HttpResponse = boost::beast::http::response<boost::beast::http::string_body>;

[[nodiscard]] HttpResponse refusal(boost::beast::http::status status, std::string_view sentence);

/// A file of the table, the status, or why there is neither.
[[nodiscard]] HttpResponse page_or_refusal(const HttpRequest& request, std::string_view allowed_origin,
                                           std::string_view status_json);

/// Why a request to open the stream is refused; nothing when it may be opened, if there is a place.
[[nodiscard]] std::optional<HttpResponse> refusal_of_stream(const HttpRequest& request,
                                                            std::string_view allowed_origin);

}  // namespace ignis
