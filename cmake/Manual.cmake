# SPDX-License-Identifier: Apache-2.0
# Manual pages and completions for bash, zsh and fish, generated from the command's registry of actions.
if(CMAKE_CROSSCOMPILING)
  return() # the command does not run here
endif()
find_package(Python3 COMPONENTS Interpreter REQUIRED)
set(manual ${PROJECT_BINARY_DIR}/manual)
add_custom_command(OUTPUT ${manual}/man/man1/curlew.1
  COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/manual.py $<TARGET_FILE:curlew> ${PROJECT_VERSION} ${manual}
  DEPENDS curlew ${PROJECT_SOURCE_DIR}/tools/manual.py COMMENT "Writing the manual pages and completions" VERBATIM)
add_custom_target(curlew_manual ALL DEPENDS ${manual}/man/man1/curlew.1)
install(DIRECTORY ${manual}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR})
install(FILES ${manual}/completions/bash/curlew DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${manual}/completions/zsh/_curlew DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${manual}/completions/fish/curlew.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
