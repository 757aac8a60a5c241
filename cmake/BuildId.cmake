# cmake -DSOURCE=CHECKOUT -DHEADER=FILE -DVERSION=X.Y.Z -P BuildId.cmake
#
# A header that names the build by a fingerprint of the sources: equal sources are one build wherever they stand, with
# or without .git, and what was edited is another. A header that would stay the same is left alone.
file(GLOB_RECURSE files RELATIVE ${SOURCE} ${SOURCE}/src/* ${SOURCE}/apps/* ${SOURCE}/lcmtypes/* ${SOURCE}/cmake/*
     ${SOURCE}/CMakeLists.txt)
list(FILTER files INCLUDE REGEX "(\\.(cmake|cpp|css|h|html|json|lcm|svg|ts)|CMakeLists\\.txt)$")
list(FILTER files EXCLUDE REGEX "/node_modules/")
set(all "")
foreach(file IN LISTS files)
  file(SHA256 ${SOURCE}/${file} fingerprint)
  string(APPEND all "${file} ${fingerprint}\n")
endforeach()
string(SHA256 id "${all}")
string(SUBSTRING ${id} 0 12 id)
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#pragma once\n#define IGNIS_BUILD \"${VERSION}+${id}\"\n")
