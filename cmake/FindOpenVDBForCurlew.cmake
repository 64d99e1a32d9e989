# SPDX-License-Identifier: Apache-2.0
# Debian ships OpenVDB's own find module beside the library instead of a package configuration.
list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
find_package(OpenVDB REQUIRED COMPONENTS openvdb)
find_package(Boost REQUIRED)
list(POP_BACK CMAKE_MODULE_PATH)
# OpenVDB's headers are not ours to warn about.
get_target_property(includes OpenVDB::openvdb INTERFACE_INCLUDE_DIRECTORIES)
if(includes)
  set_target_properties(OpenVDB::openvdb PROPERTIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${includes}")
endif()
