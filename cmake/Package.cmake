# find_package(curlew): targets curlew::base … curlew::app, as in the build tree.
include(CMakePackageConfigHelpers)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/curlew DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT curlewTargets NAMESPACE curlew:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/curlew)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/curlewConfig.cmake.in
  ${PROJECT_BINARY_DIR}/curlewConfig.cmake INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/curlew)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/curlewConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/curlewConfig.cmake ${PROJECT_BINARY_DIR}/curlewConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/FindOpenVDBForCurlew.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/curlew)
