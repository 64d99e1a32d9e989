# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD_DIR=… -DSOURCE_DIR=… -DWORK_DIR=… [-DEXAMPLE=…] -P run.cmake
# Installs BUILD_DIR to a new prefix, builds EXAMPLE (default: the README's) against it as a user would, and runs it.
foreach(name BUILD_DIR SOURCE_DIR WORK_DIR)
  if(NOT ${name})
    message(FATAL_ERROR "run.cmake: give -D${name}=")
  endif()
endforeach()
if(NOT EXAMPLE)
  set(EXAMPLE ${SOURCE_DIR}/tests/app/ReadmeExample.cpp)
endif()

# The example is built with the same compiler as the library.
load_cache(${BUILD_DIR} READ_WITH_PREFIX "" CMAKE_GENERATOR CMAKE_BUILD_TYPE CMAKE_CXX_COMPILER)

function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK_DIR} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Old files and the user's settings must not affect the result.
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
unset(ENV{DESTDIR})
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE_DIR}/tests/package -B ${WORK_DIR}/build -G ${CMAKE_GENERATOR}
  -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE} -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
  -DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix -DEXAMPLE=${EXAMPLE} -DC_EXAMPLE=${SOURCE_DIR}/tests/plugin/header.c)
run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run(${WORK_DIR}/build/example)
run(${WORK_DIR}/build/c_example)
run(${WORK_DIR}/build/pc_example)
# The Python package finds the library that is installed with it.
file(GLOB_RECURSE package ${WORK_DIR}/prefix/lib/python3/dist-packages/curlew/__init__.py)
cmake_path(GET package PARENT_PATH package)
cmake_path(GET package PARENT_PATH package)
unset(ENV{CURLEW_LIBRARY})
set(ENV{PYTHONPATH} ${package})
run(/usr/bin/python3 -B -c "import curlew; print(curlew.find_library()); print(curlew.version())")
