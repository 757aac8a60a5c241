# Writes OUTPUT: a C++ table of the files of the web client, so that serving a request never touches the disk. The
# assembler takes the bytes as they are (.incbin): as literals they would cost the compiler a minute.
# cmake -DOUTPUT=... -DFOLDER=... -P embed_web.cmake

set(type_html "text/html; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_svg "image/svg+xml")
set(type_woff2 "font/woff2")

file(GLOB files RELATIVE ${FOLDER} ${FOLDER}/*)
set(bytes "")
set(arrays "")
set(rows "")
set(number 0)
foreach(file IN LISTS files)
  cmake_path(GET file EXTENSION LAST_ONLY extension)
  string(SUBSTRING "${extension}" 1 -1 extension)
  if(NOT DEFINED type_${extension})
    message(FATAL_ERROR "${file}: no content type for .${extension}; add it to embed_web.cmake")
  endif()
  file(SIZE ${FOLDER}/${file} size)
  file(SHA256 ${FOLDER}/${file} hash)
  set(symbol "ignis_web_file_${number}")
  # The hash makes the table another text when a file has changed: no compiler cache sees what .incbin reads.
  string(APPEND bytes "    \"${symbol}: .incbin \\\"${FOLDER}/${file}\\\"\\n\"  // ${hash}\n")
  string(APPEND arrays "extern const char ${symbol}[] __attribute__((visibility(\"hidden\")));\n")
  set(path "/${file}")
  if(file STREQUAL "index.html")
    set(path "/")
  endif()
  string(APPEND rows "    {\"${path}\", \"${type_${extension}}\", {${symbol}, ${size}}},\n")
  math(EXPR number "${number} + 1")
endforeach()

file(WRITE ${OUTPUT} "// Generated from the web client's files.
#include \"map_builder/web_files.h\"

asm(\".pushsection .rodata\\n\"
${bytes}    \".popsection\\n\");

extern \"C\" {
${arrays}}

namespace ignis {
namespace {
constexpr WebFile kFiles[] = {
${rows}};
}  // namespace

std::span<const WebFile> web_files() { return kFiles; }

}  // namespace ignis
")
