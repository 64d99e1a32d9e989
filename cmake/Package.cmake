# SPDX-License-Identifier: Apache-2.0
# Installs the files for find_package(curlew): targets curlew::base … curlew::app, as in the build tree. Configures the
# Debian package.
include(CMakePackageConfigHelpers)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/curlew DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT curlewTargets NAMESPACE curlew:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/curlew)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/curlewConfig.cmake.in
  ${PROJECT_BINARY_DIR}/curlewConfig.cmake INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/curlew)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/curlewConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/curlewConfig.cmake ${PROJECT_BINARY_DIR}/curlewConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/FindOpenVDBForCurlew.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/curlew)
install(FILES ${PROJECT_SOURCE_DIR}/NOTICE ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
# The software bill of materials of what is compiled in; versions come from dpkg.
find_program(CURLEW_DPKG_QUERY dpkg-query)
find_program(CURLEW_PYTHON3 python3)
if(CURLEW_DPKG_QUERY AND CURLEW_PYTHON3)
  install(CODE "execute_process(COMMAND ${CURLEW_PYTHON3} -B ${PROJECT_SOURCE_DIR}/tools/packages/sbom.py
    --version ${PROJECT_VERSION} --out ${PROJECT_BINARY_DIR}/sbom.spdx.json COMMAND_ERROR_IS_FATAL ANY)")
  install(FILES ${PROJECT_BINARY_DIR}/sbom.spdx.json DESTINATION ${CMAKE_INSTALL_DOCDIR})
endif()

# ./dev package. The Blender add-on is not part of an installation, so ./dev packs it into this folder before.
set(CPACK_INSTALLED_DIRECTORIES ${PROJECT_BINARY_DIR}/blender usr/share/curlew/blender)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The Curlew developers <curlew@example.org>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON) # dependencies of the command and the library
set(CPACK_DEBIAN_PACKAGE_DEPENDS python3-numpy)
# To build with the C++ library: what the build needs, too.
file(STRINGS ${PROJECT_SOURCE_DIR}/cmake/packages.txt suggested REGEX "^[^# ]+-dev *(#|$)")
list(TRANSFORM suggested REPLACE " .*" "")
list(JOIN suggested ", " CPACK_DEBIAN_PACKAGE_SUGGESTS)
include(CPack)
