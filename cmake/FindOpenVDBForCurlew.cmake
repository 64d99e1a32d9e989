# SPDX-License-Identifier: Apache-2.0
# Debian ships OpenVDB's own find module beside the library instead of a package configuration.
set(CMAKE_POLICY_DEFAULT_CMP0167 OLD) # OpenVDB's module uses FindBoost; newer versions of CMake warn about it
list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
find_package(OpenVDB REQUIRED COMPONENTS openvdb)
find_package(Boost CONFIG REQUIRED)
list(POP_BACK CMAKE_MODULE_PATH)
# System headers: no warnings from OpenVDB's headers.
get_target_property(includes OpenVDB::openvdb INTERFACE_INCLUDE_DIRECTORIES)
if(includes)
  set_target_properties(OpenVDB::openvdb PROPERTIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${includes}")
endif()
