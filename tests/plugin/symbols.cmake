# SPDX-License-Identifier: Apache-2.0
# cmake -DLIBRARY=… -DHEADER=… -DNM=… -DREADELF=… -P symbols.cmake
# The library exports exactly the functions that the header declares and curlew_command(), which the launcher calls
# (src/Command.cpp), and its soname contains its ABI version.
execute_process(COMMAND ${NM} -D --defined-only --format=posix ${LIBRARY} OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[^ \n]+" exported "${listed}")
list(TRANSFORM exported STRIP)
list(SORT exported)
file(READ ${HEADER} header)
string(REGEX MATCHALL "CURLEW_API [^;(]*curlew_[a-z_]+\\(" declared "${header}")
list(TRANSFORM declared REPLACE ".*(curlew_[a-z_]+)\\($" "\\1")
list(APPEND declared curlew_command)
list(SORT declared)
if(NOT declared OR NOT "${exported}" STREQUAL "${declared}")
  message(FATAL_ERROR "exported: ${exported}\ndeclared: ${declared}")
endif()
string(REGEX MATCH "CURLEW_ABI_VERSION ([0-9]+)" version "${header}")
execute_process(COMMAND ${READELF} -d ${LIBRARY} OUTPUT_VARIABLE dynamic COMMAND_ERROR_IS_FATAL ANY)
if(NOT dynamic MATCHES "soname: \\[libcurlew\\.so\\.${CMAKE_MATCH_1}\\]")
  message(FATAL_ERROR "the soname is not libcurlew.so.${CMAKE_MATCH_1}: ${dynamic}")
endif()
