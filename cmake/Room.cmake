# One library target per room (see DESIGN in CONTRIBUTING.md): src/<room>/*.cpp and include/curlew/<room>/*.h.

# How all of our own code is compiled; not part of the installed interface.
add_library(curlew_options INTERFACE)
target_compile_options(curlew_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${CURLEW_WERROR}>:-Werror>
  # GCC 12 takes members with a default initialiser, and its own <regex>, for uninitialised; clang-tidy looks for the real ones.
  -Wno-maybe-uninitialized
  # Same bits everywhere: no contraction behind our back; fused multiply-add only where it is written.
  -ffp-contract=off)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_options(curlew_options INTERFACE -march=x86-64-v3)
endif()
if(CURLEW_SANITIZE)
  add_compile_options(-fsanitize=${CURLEW_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${CURLEW_SANITIZE})
endif()

find_program(CURLEW_CCACHE ccache)
if(CURLEW_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CURLEW_CCACHE})
endif()

# curlew_room(<room> DEPENDS <public targets> [PRIVATE <private targets>] [PCH <headers>])
function(curlew_room room)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PRIVATE;PCH" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${room}/*.cpp)
  set(target curlew_${room})
  if(sources)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:curlew_options>)
    if(ARG_PCH)
      target_precompile_headers(${target} PRIVATE ${ARG_PCH})
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
