# cmake --install build --prefix DIR: the program, its man pages (where help2man is installed), the checkerboard tool where the
# program looks for it, examples, udev rules, service (udev and systemd read theirs only under /usr/lib, so a package sets --prefix /usr), documents.
include(GNUInstallDirs)
set(packaging ${PROJECT_SOURCE_DIR}/packaging)

# Components, so that a package may bring the program without OpenCV: cmake --install build --component program
install(TARGETS vergence RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
if(VERGENCE_CHECKERBOARD)
  # OPTIONAL: a build of the target vergence alone has none.
  install(TARGETS vergence-checkerboard RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/vergence COMPONENT checkerboard OPTIONAL)
endif()
if(VERGENCE_ROS2)
  install(TARGETS vergence-ros2 RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ros2 OPTIONAL)
  install(FILES ${packaging}/vergence-ros2.service DESTINATION lib/systemd/system COMPONENT ros2)
endif()
file(GLOB configurations CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/app/config/*.yaml)
install(FILES ${configurations} DESTINATION ${CMAKE_INSTALL_DATADIR}/vergence/config COMPONENT program)

install(FILES ${PROJECT_SOURCE_DIR}/udev/99-vergence.rules DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES ${packaging}/vergence.service DESTINATION lib/systemd/system COMPONENT program)
install(FILES ${packaging}/10-vergence.conf DESTINATION lib/sysctl.d COMPONENT program)
install(PROGRAMS ${packaging}/vergence-session DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/vergence COMPONENT program)

# When installing, so that they are those of the program that is installed. help2man needs the program to run here.
set(manuals ${PROJECT_BINARY_DIR}/manuals)
install(CODE "execute_process(COMMAND \"${CMAKE_COMMAND}\" \"-DPROGRAM=${CMAKE_CROSSCOMPILING_EMULATOR};$<TARGET_FILE:vergence>\" \"-DVERSION=${PROJECT_VERSION}\"
    \"-DOUT=${manuals}\" -P \"${PROJECT_SOURCE_DIR}/scripts/cmake/manuals.cmake\" COMMAND_ERROR_IS_FATAL ANY)" COMPONENT program)
install(DIRECTORY ${manuals}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT program OPTIONAL)

install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${packaging}/debian/copyright
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
# Where the README's links look for them.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
foreach(driver gige iidc v4l2)
  install(FILES ${PROJECT_SOURCE_DIR}/drivers/${driver}/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/drivers/${driver} COMPONENT program)
endforeach()
