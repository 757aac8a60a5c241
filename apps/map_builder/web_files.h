// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace ignis {

/// One file of the web client, as it was when the program was built.
struct WebFile {
  std::string_view path;  ///< of the request, such as "/view.js"
  std::string_view content_type;
  std::string_view content;
};

/// The whole table. A request is answered from here or not at all.
[[nodiscard]] std::span<const WebFile> web_files();

}  // namespace ignis
