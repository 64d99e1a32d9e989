# SPDX-License-Identifier: Apache-2.0
# The output of `curlew -version`: the versions of Curlew and of its libraries, and the commit. curlew_version(<target>)
# adds them to a target as declared in curlew/app/Version.h. As a script (cmake -P, with SOURCE_DIR, TEMPLATE, OUTPUT,
# version and libraries), this file writes the source file in each build, since the commit may have changed.
if(CMAKE_SCRIPT_MODE_FILE)
  execute_process(COMMAND git -C ${SOURCE_DIR} describe --always --dirty --abbrev=10 --exclude=* OUTPUT_VARIABLE commit
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(failed)
    set(commit unknown) # not a checkout
  endif()
  configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
  return()
endif()

# Sets `result` to the libraries that NOTICE says Curlew uses itself, with their versions: "OpenVDB 10.0.1, …".
function(curlew_libraries result)
  find_package(PkgConfig REQUIRED)
  set(version_OpenVDB ${OpenVDB_VERSION})
  set(version_Boost ${Boost_VERSION_STRING})
  set(version_Embree ${embree_VERSION})
  file(STRINGS ${CURLEW_NANOVDB_INCLUDE}/nanovdb/NanoVDB.h lines REGEX "define NANOVDB_[A-Z]+_VERSION_NUMBER")
  list(TRANSFORM lines REPLACE ".*NUMBER ([0-9]+).*" "\\1")
  list(JOIN lines . version_NanoVDB)
  # The names of pkg-config's modules that differ from those of the libraries.
  set(module_oneTBB tbb)
  set(module_c-blosc blosc)
  set(module_Assimp assimp)
  set(module_muParser muparser)
  set(module_Highway libhwy)
  set(module_nlohmann-json nlohmann_json)
  set("module_KISS FFT" kissfft-float)

  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/NOTICE)
  file(STRINGS ${PROJECT_SOURCE_DIR}/NOTICE rows REGEX "^  .*  Curlew  ")
  foreach(row ${rows})
    string(REGEX REPLACE "^  ([^ ]+( [^ ]+)?)  .*" "\\1" name ${row})
    set(version "${version_${name}}")
    if(NOT version)
      set(module ${name})
      if(DEFINED "module_${name}")
        set(module ${module_${name}})
      endif()
      pkg_check_modules(found_${module} QUIET ${module})
      set(version "${found_${module}_VERSION}")
    endif()
    string(STRIP "${name} ${version}" text) # only the name if the version is unknown
    list(APPEND libraries ${text})
  endforeach()
  list(JOIN libraries ", " text)
  set(${result} ${text} PARENT_SCOPE)
endfunction()

function(curlew_version target)
  curlew_libraries(libraries)
  set(output ${PROJECT_BINARY_DIR}/generated/Version.cpp)
  add_custom_target(${target}_version BYPRODUCTS ${output} VERBATIM
    COMMAND ${CMAKE_COMMAND} -DSOURCE_DIR=${PROJECT_SOURCE_DIR} -DTEMPLATE=${PROJECT_SOURCE_DIR}/cmake/Version.cpp.in
      -DOUTPUT=${output} -Dversion=${PROJECT_VERSION} -Dlibraries=${libraries} -P ${PROJECT_SOURCE_DIR}/cmake/Version.cmake)
  add_dependencies(${target} ${target}_version)
  target_sources(${target} PRIVATE ${output})
  set_source_files_properties(${output} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
endfunction()
