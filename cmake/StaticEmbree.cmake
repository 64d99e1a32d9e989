# SPDX-License-Identifier: Apache-2.0
# Debian's Embree has 44 MB of code for all its kinds of geometry, rays and processors. With CURLEW_EMBREE_SOURCE, only what
# src/vdb/RayMesh.cpp uses is compiled into a static library: triangles, single rays and packets of 8, for AVX2.
set(CURLEW_EMBREE_SOURCE "" CACHE PATH
  "Source of the installed version of Embree 3, to link it statically (./dev fetches it); empty: link the shared library")

# If the linker does not find a symbol of embree::, its file is missing here.
set(embree_sources
  common/lexers/tokenstream.cpp common/math/constants.cpp common/simd/sse.cpp common/tasking/taskschedulertbb.cpp
  common/sys/alloc.cpp common/sys/barrier.cpp common/sys/condition.cpp common/sys/mutex.cpp common/sys/regression.cpp
  common/sys/string.cpp common/sys/sysinfo.cpp common/sys/thread.cpp
  kernels/builders/primrefgen.cpp
  kernels/bvh/bvh.cpp kernels/bvh/bvh4_factory.cpp kernels/bvh/bvh8_factory.cpp kernels/bvh/bvh_builder.cpp
  kernels/bvh/bvh_builder_morton.cpp kernels/bvh/bvh_builder_sah.cpp kernels/bvh/bvh_builder_sah_mb.cpp
  kernels/bvh/bvh_builder_sah_spatial.cpp kernels/bvh/bvh_builder_twolevel.cpp kernels/bvh/bvh_collider.cpp
  kernels/bvh/bvh_intersector1_bvh4.cpp kernels/bvh/bvh_intersector1_bvh8.cpp
  kernels/bvh/bvh_intersector_hybrid4_bvh4.cpp kernels/bvh/bvh_intersector_hybrid4_bvh8.cpp
  kernels/bvh/bvh_intersector_hybrid8_bvh4.cpp kernels/bvh/bvh_intersector_hybrid8_bvh8.cpp
  kernels/bvh/bvh_intersector_stream_bvh4.cpp kernels/bvh/bvh_intersector_stream_bvh8.cpp
  kernels/bvh/bvh_intersector_stream_filters.cpp kernels/bvh/bvh_refit.cpp kernels/bvh/bvh_rotate.cpp
  kernels/bvh/bvh_statistics.cpp
  kernels/common/acceln.cpp kernels/common/accelset.cpp kernels/common/alloc.cpp kernels/common/device.cpp
  kernels/common/geometry.cpp kernels/common/rtcore.cpp kernels/common/scene.cpp
  kernels/common/scene_triangle_mesh.cpp kernels/common/stat.cpp kernels/common/state.cpp
  kernels/geometry/primitive4.cpp kernels/geometry/primitive8.cpp)

function(curlew_static_embree target)
  if(NOT EXISTS ${CURLEW_EMBREE_SOURCE}/kernels/common/rtcore.cpp)
    message(FATAL_ERROR "CURLEW_EMBREE_SOURCE: '${CURLEW_EMBREE_SOURCE}' does not contain the source of Embree")
  endif()
  list(TRANSFORM embree_sources PREPEND ${CURLEW_EMBREE_SOURCE}/)
  add_library(${target} STATIC ${embree_sources})
  # Embree's files include "../config.h", "../hash.h" and "rtcore_config.h", which its build would make in its source.
  set(made ${CMAKE_CURRENT_BINARY_DIR}/embree_config)
  file(MAKE_DIRECTORY ${made}/common)
  # config.h.in takes these variables, which find_package has set as in Debian's build.
  foreach(part GEOMETRY_QUAD GEOMETRY_CURVE GEOMETRY_SUBDIVISION GEOMETRY_USER GEOMETRY_INSTANCE GEOMETRY_GRID GEOMETRY_POINT
      FILTER_FUNCTION RAY_MASK)
    set(EMBREE_${part} OFF)
  endforeach()
  math(EXPR EMBREE_VERSION_NUMBER "${EMBREE_VERSION_MAJOR} * 10000 + ${EMBREE_VERSION_MINOR} * 100 + ${EMBREE_VERSION_PATCH}")
  foreach(header config hash rtcore_config)
    configure_file(${CURLEW_EMBREE_SOURCE}/kernels/${header}.h.in ${made}/${header}.h)
  endforeach()
  target_include_directories(${target} PRIVATE ${made} ${made}/common)
  target_include_directories(${target} SYSTEM INTERFACE ${EMBREE_INCLUDE_DIRS})
  target_compile_features(${target} PRIVATE cxx_std_11)
  target_compile_definitions(${target} PRIVATE TASKING_TBB EMBREE_TARGET_AVX2 EMBREE_LOWEST_ISA EMBREE_STATIC_LIB)
  # -O2 as in Debian's build; the others are those of Embree's own build that change what the compiler may assume.
  target_compile_options(${target} PRIVATE -w -O2 -mavx2 -mfma -mf16c -mlzcnt -mbmi -mbmi2 -fno-strict-aliasing -fwrapv
    -fno-delete-null-pointer-checks -fno-tree-vectorize -fsigned-char -ffunction-sections -fdata-sections)
  # The linker leaves out the functions that nothing uses.
  target_link_options(${target} INTERFACE LINKER:--gc-sections)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON CXX_EXTENSIONS OFF)
  target_link_libraries(${target} PRIVATE TBB::tbb)
endfunction()
