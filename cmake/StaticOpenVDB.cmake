# SPDX-License-Identifier: Apache-2.0
# Debian has OpenVDB as a shared library only. A host such as Blender loads a build of its own, whose symbols would be
# used instead of ours, and its 50,000 symbols take 40 ms of every start. With CURLEW_OPENVDB_SOURCE, the parts that we
# use are compiled from the source of the installed version into a static library.
set(CURLEW_OPENVDB_SOURCE "" CACHE PATH
  "Source of the installed version of OpenVDB, to link it statically (./dev fetches it); empty: link the shared library")

# The headers of openvdb/tools that declare `extern` instantiations which we or our tests use. If the linker does not find a function
# of openvdb::tools, its header is missing here.
set(headers ChangeBackground Composite FastSweeping GridOperators LevelSetFilter LevelSetMeasure LevelSetPlatonic
  LevelSetRebuild LevelSetSphere LevelSetTracker LevelSetUtil MeshToVolume Morphology Prune SignedFloodFill VolumeToMesh
  VolumeToSpheres)

function(curlew_static_openvdb target)
  set(folder ${CURLEW_OPENVDB_SOURCE}/openvdb/openvdb)
  file(GLOB core ${folder}/*.cc ${folder}/io/*.cc ${folder}/math/*.cc ${folder}/points/*.cc ${folder}/util/*.cc)
  if(NOT core)
    message(FATAL_ERROR "CURLEW_OPENVDB_SOURCE: '${CURLEW_OPENVDB_SOURCE}' does not contain the source of OpenVDB")
  endif()
  set(instantiations ${CMAKE_CURRENT_BINARY_DIR}/openvdb_instantiations)
  foreach(header IN LISTS headers)
    string(TOUPPER ${header} upper)
    file(CONFIGURE OUTPUT ${instantiations}/${header}.cpp CONTENT
      "#include \"OpenvdbTrees.h\"\n#define OPENVDB_INSTANTIATE_${upper}\n#include <openvdb/tools/${header}.h>\n" @ONLY)
    list(APPEND core ${instantiations}/${header}.cpp)
  endforeach()
  add_library(${target} STATIC ${core})
  find_path(CURLEW_OPENVDB_VERSION openvdb/version.h REQUIRED) # the source has only a template of it
  target_include_directories(${target} PRIVATE ${CURLEW_OPENVDB_SOURCE}/openvdb ${PROJECT_SOURCE_DIR}/cmake
    ${CURLEW_OPENVDB_VERSION}/openvdb)
  target_compile_features(${target} PRIVATE cxx_std_17)
  target_compile_definitions(${target} PRIVATE OPENVDB_PRIVATE)
  # Its sources test macros of version.h before they include it. Its assertions stay, as in Debian's build: they stop a
  # damaged file before it damages memory.
  target_compile_options(${target} PRIVATE -w -include openvdb/version.h -UNDEBUG -ffunction-sections -fdata-sections)
  # The linker leaves out the functions that nothing uses, and with them what only they need.
  target_link_options(${target} INTERFACE LINKER:--gc-sections)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON)
  foreach(library OpenVDB::openvdb Boost::iostreams)
    target_compile_definitions(${target} PUBLIC $<TARGET_PROPERTY:${library},INTERFACE_COMPILE_DEFINITIONS>)
  endforeach()
  # Boost's symbols do not tell their version either.
  find_library(CURLEW_STATIC_IOSTREAMS libboost_iostreams.a REQUIRED)
  get_target_property(libraries OpenVDB::openvdb INTERFACE_LINK_LIBRARIES)
  list(TRANSFORM libraries REPLACE ^Boost::iostreams$ ${CURLEW_STATIC_IOSTREAMS})
  target_link_libraries(${target} PUBLIC ${libraries} ${CURLEW_BLOSC} ZLIB::ZLIB)
endfunction()
