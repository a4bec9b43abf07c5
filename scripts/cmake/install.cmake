# cmake --install build --prefix DIR: the program, the checkerboard tool where the program looks for it, the example configurations, the udev
# rules (udev reads them only under /usr/lib, so a package sets --prefix /usr), the documents.
include(GNUInstallDirs)

# Components, so that a package may bring the program without OpenCV: cmake --install build --component program
install(TARGETS vergence RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
if(VERGENCE_CHECKERBOARD)
  # OPTIONAL: a build of the target vergence alone has none.
  install(PROGRAMS $<TARGET_FILE:vergence-checkerboard> DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/vergence COMPONENT checkerboard OPTIONAL)
endif()
file(GLOB configurations CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/app/config/*.yaml)
install(FILES ${configurations} DESTINATION ${CMAKE_INSTALL_DATADIR}/vergence/config COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/udev/99-vergence.rules DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${PROJECT_SOURCE_DIR}/LICENSE
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
