# SPDX-License-Identifier: Apache-2.0
# One library target per room (see "The layout" in CONTRIBUTING.md): src/<room>/*.cpp and include/curlew/<room>/*.h.

# Compile options for all of our own code; not part of the installed interface.
add_library(curlew_options INTERFACE)
target_compile_options(curlew_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  # Clang reports floats that a test compares with doubles, GCC does not.
  $<$<NOT:$<AND:$<CXX_COMPILER_ID:Clang>,$<BOOL:$<TARGET_PROPERTY:CURLEW_TEST>>>>:-Wdouble-promotion>
  -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${CURLEW_WERROR}>:-Werror>
  # GCC 12 reports members with a default initialiser, and its own <regex>, as uninitialised; clang-tidy finds the real
  # ones.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
  # GCC 12 and 14 take a literal + std::string for an overflow, depending on what they inline. Clang keeps these warnings.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>
  # In a batch of files, GCC takes anonymous namespaces for those of headers.
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${CURLEW_BATCHES}>>:-Wno-subobject-linkage>
  # Clang's -Wconversion would include it, GCC's does not in C++.
  $<$<CXX_COMPILER_ID:Clang>:-Wno-sign-conversion>
  # Kernels combine comparisons with & and |, which are those of lanes or of single numbers.
  $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-instead-of-logical>
  # The same bits everywhere: no implicit contraction; fused multiply-add only if written explicitly.
  -ffp-contract=off
  # Nothing reads errno or the floating-point flags after a square root. Does not change values.
  -fno-math-errno -fno-trapping-math)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_options(curlew_options INTERFACE
    -march=x86-64-$<IF:$<STREQUAL:$<TARGET_PROPERTY:CURLEW_SIMD>,Avx512>,v4,v3>)
endif()
if(CURLEW_SANITIZE)
  # Without the checks that take longest to compile: null pointers, which crash anyway, types and sizes of objects, and
  # alignment: in TBB's hash map, misaligned addresses are flags.
  add_compile_options(-fsanitize=${CURLEW_SANITIZE} -fno-sanitize=null,vptr,object-size,alignment -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${CURLEW_SANITIZE})
endif()

find_program(CURLEW_CCACHE ccache)
if(CURLEW_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Without this sloppiness, ccache keeps nothing that uses a precompiled header. With the base directory, checkouts in
  # different folders share what they compile.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} ${CURLEW_CCACHE})
endif()

# curlew_kernels(<target> <file>...): adds files named *Kernels.cpp to a target, compiled once for each instruction set
# in math/Lanes.h. Highway's own AVX2 and AVX-512 targets would also require AES, which is not needed here.
function(curlew_kernels target)
  if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    return()
  endif()
  foreach(simd Avx2 Avx512)
    add_library(${target}_${simd} OBJECT ${ARGN})
    target_compile_definitions(${target}_${simd} PRIVATE CURLEW_SIMD=${simd} HWY_DISABLE_PCLMUL_AES)
    target_link_libraries(${target}_${simd} PRIVATE curlew_options)
    target_include_directories(${target}_${simd} PRIVATE ${PROJECT_SOURCE_DIR}/include)
    # Without optimisation, nothing is inlined and AVX-512 code would leak into shared functions. With sanitizers,
    # compiling would take hours.
    target_compile_options(${target}_${simd} PRIVATE $<$<NOT:$<CONFIG:Release>>:-O2>)
    if(CURLEW_SANITIZE)
      target_compile_options(${target}_${simd} PRIVATE -fno-sanitize=all)
    endif()
    target_compile_features(${target}_${simd} PRIVATE cxx_std_20)
    set_target_properties(${target}_${simd} PROPERTIES CURLEW_SIMD ${simd} POSITION_INDEPENDENT_CODE ON)
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:${target}_${simd}>)
  endforeach()
endfunction()

# curlew_precompile_where_included(<target> <header>): precompiles a header for the files of a target that include it
# themselves. The others compile faster without it.
function(curlew_precompile_where_included target header)
  target_precompile_headers(${target} PRIVATE <${header}>)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  foreach(source IN LISTS sources)
    file(STRINGS ${source} found REGEX "#include \"${header}\"" LIMIT_COUNT 1)
    if(NOT found)
      set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
    endif()
  endforeach()
endfunction()

# curlew_room(<room> DEPENDS <public targets> [PRIVATE <private targets>] [PCH <headers>] [ALONE <names of files>]
#   [O1 <names of files>])
# O1: files of ALONE to compile with -O1. They cannot use a header that was precompiled with other options.
# Compiles several files as one, except for those named after ALONE. Ten files of app then take 16 instead of 42 s, because
# each file instantiates the same templates. The names in all anonymous namespaces of a room must therefore differ.
function(curlew_room room)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PRIVATE;PCH;ALONE;O1" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${room}/*.cpp)
  set(kernels ${sources})
  list(FILTER kernels INCLUDE REGEX "Kernels\\.cpp$")
  list(FILTER sources EXCLUDE REGEX "Kernels\\.cpp$")
  set(target curlew_${room})
  if(sources)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:curlew_options>)
    if(ARG_PCH)
      target_precompile_headers(${target} PRIVATE ${ARG_PCH})
    endif()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ${CURLEW_BATCHES} UNITY_BUILD_BATCH_SIZE 10)
    list(TRANSFORM ARG_ALONE REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/src/${room}/\\1.cpp")
    set_source_files_properties(${ARG_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    list(TRANSFORM ARG_O1 REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/src/${room}/\\1.cpp")
    set_source_files_properties(${ARG_O1} PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O1>
      SKIP_PRECOMPILE_HEADERS ON)
    if(kernels)
      curlew_kernels(${target} ${kernels})
    endif()
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} ${scope} ${ARG_DEPENDS})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${room})
  add_library(curlew::${room} ALIAS ${target})
  install(TARGETS ${target} EXPORT curlewTargets)
endfunction()
