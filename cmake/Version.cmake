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

function(curlew_version target)
  find_package(PkgConfig REQUIRED)
  set(libraries "OpenVDB ${OpenVDB_VERSION}")
  foreach(pair oneTBB=tbb OpenEXR=OpenEXR Imath=Imath Blosc=blosc zlib=zlib libpng=libpng Assimp=assimp fmt=fmt
               muParser=muparser Highway=libhwy nlohmann-json=nlohmann_json nanoflann=nanoflann)
    string(REPLACE "=" ";" pair ${pair})
    list(GET pair 0 name)
    list(GET pair 1 module)
    pkg_check_modules(found_${module} QUIET ${module})
    if(found_${module}_FOUND)
      string(APPEND libraries ", ${name} ${found_${module}_VERSION}")
    endif()
  endforeach()
  if(embree_VERSION)
    string(APPEND libraries ", Embree ${embree_VERSION}")
  endif()
  set(output ${PROJECT_BINARY_DIR}/generated/Version.cpp)
  add_custom_target(${target}_version BYPRODUCTS ${output} VERBATIM
    COMMAND ${CMAKE_COMMAND} -DSOURCE_DIR=${PROJECT_SOURCE_DIR} -DTEMPLATE=${PROJECT_SOURCE_DIR}/cmake/Version.cpp.in
      -DOUTPUT=${output} -Dversion=${PROJECT_VERSION} -Dlibraries=${libraries} -P ${PROJECT_SOURCE_DIR}/cmake/Version.cmake)
  add_dependencies(${target} ${target}_version)
  target_sources(${target} PRIVATE ${output})
  set_source_files_properties(${output} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
endfunction()
