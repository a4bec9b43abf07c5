# cpack, in a build folder: Debian packages of what `cmake --install` puts down, in BUILD/packages. The same commit gives the same bytes.
#   vergence_VERSION_ARCHITECTURE.deb                the program: component program
#   vergence-checkerboard_VERSION_ARCHITECTURE.deb   the tool with OpenCV: component checkerboard, where it is built
#   vergence-ros2_VERSION_ARCHITECTURE.deb           the bridge with a DDS: component ros2, where it is built
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGE_VENDOR vergence)
set(CPACK_PACKAGE_CONTACT "vergence maintainers <maintainers@vergence.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program)
if(VERGENCE_CHECKERBOARD)
  list(APPEND CPACK_COMPONENTS_ALL checkerboard)
endif()
if(VERGENCE_ROS2)
  list(APPEND CPACK_COMPONENTS_ALL ros2)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
# Where a cross compiler is at work, dpkg would name the host.
set(debian_architecture_x86_64 amd64)
set(debian_architecture_aarch64 arm64)
set(debian_architecture_armv7l armhf)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${debian_architecture_${CMAKE_SYSTEM_PROCESSOR}})

# Explicit, not computed: dpkg-shlibdeps wants the libraries of a foreign architecture installed. The names are the same on all
# three; a test compares them with dpkg-shlibdeps' on the host (tests/system/packages).
set(libraries_of_both
  "libaravis-0.8-0 (>= 0.8.26)" "libc6 (>= 2.36)" "libdc1394-25 (>= 2.2.6)" "libdeflate0" "libfmt9 (>= 9.1.0)" "libgcc-s1 (>= 3.5)" "libgeographiclib23"
  "libglib2.0-0 (>= 2.74)" "libhwy1 (>= 1.0.3)" "libjpeg62-turbo (>= 1:2.1)" "libpng16-16 (>= 1.6.2)" "libserialport0" "libstdc++6 (>= 12)"
  "libusb-1.0-0 (>= 2:1.0.26)" "libyaml-cpp0.7")
list(JOIN libraries_of_both ", " libraries_of_both)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "adduser, ${libraries_of_both}, libbz2-1.0, liblz4-1, libmicrohttpd12 (>= 0.9.75), libsqlite3-0 (>= 3.40), libsystemd0 (>= 246), libzstd1 (>= 1.5.2)")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME vergence)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "vergence-checkerboard, vergence-ros2, systemd, udev")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "stereo visual odometry that finds and keeps its own calibration
Reads two or more rigidly mounted cameras (GigE Vision, IIDC, V4L2), a
trigger board and a geodetic INS; gives a pose for every pair, with a status
that says whether to use it, and watches the rig's calibration on the way.")
set(scripts ${PROJECT_SOURCE_DIR}/packaging/debian)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONTROL_EXTRA ${scripts}/postinst ${scripts}/prerm ${scripts}/postrm)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONTROL_STRICT_PERMISSION TRUE)

set(CPACK_DEBIAN_CHECKERBOARD_PACKAGE_DEPENDS
  "vergence (= ${PROJECT_VERSION}), ${libraries_of_both}, libapriltag3 (>= 3.3.0), libopencv-calib3d406, libopencv-contrib406, libopencv-core406, libopencv-imgproc406")
set(CPACK_DEBIAN_CHECKERBOARD_PACKAGE_NAME vergence-checkerboard)
set(CPACK_DEBIAN_CHECKERBOARD_PACKAGE_SECTION science)
set(CPACK_COMPONENT_CHECKERBOARD_DESCRIPTION "calibration of vergence's cameras with a board
Started by 'vergence calibrate'; converts calibrations of Kalibr, ROS and
OpenCV, too.")

set(CPACK_DEBIAN_ROS2_PACKAGE_DEPENDS "vergence (= ${PROJECT_VERSION}), libc6 (>= 2.36), libdeflate0, libfastrtps2.9 (>= 2.9.1), libfmt9 (>= 9.1.0), libgcc-s1 (>= 3.5), libgeographiclib23, libstdc++6 (>= 12), libsystemd0 (>= 246)")
set(CPACK_DEBIAN_ROS2_PACKAGE_NAME vergence-ros2)
set(CPACK_DEBIAN_ROS2_PACKAGE_SECTION science)
set(CPACK_DEBIAN_ROS2_PACKAGE_SUGGESTS systemd)
set(CPACK_COMPONENT_ROS2_DESCRIPTION "ROS 2 topics of vergence without a ROS installation
Publishes odometry, transforms, calibration, images, positions and
diagnostics of a running vergence over DDS, and offers a service that asks
for a recalibration.")
set(CPACK_DEBIAN_ROS2_PACKAGE_CONTROL_EXTRA ${scripts}/ros2/postinst ${scripts}/ros2/prerm ${scripts}/ros2/postrm)
set(CPACK_DEBIAN_ROS2_PACKAGE_CONTROL_STRICT_PERMISSION TRUE)

# The time in the archives and in the changelog.
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/scripts/cmake/source_date.cmake)
set(date_of_sources ${PROJECT_SOURCE_DIR}/scripts/cmake/source_date.cmake)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  set(document ${PROJECT_BINARY_DIR}/packages-documents/${component})
  string(TOUPPER ${component} COMPONENT)
  set(package ${CPACK_DEBIAN_${COMPONENT}_PACKAGE_NAME})
  if(NOT component STREQUAL program)
    install(FILES ${scripts}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
  endif()
  install(CODE "set(package ${package})
    set(version ${PROJECT_VERSION})
    set(contact \"${CPACK_PACKAGE_CONTACT}\")
    set(out ${document})
    include(${PROJECT_SOURCE_DIR}/scripts/cmake/debian_changelog.cmake)" COMPONENT ${component})
  install(FILES ${document}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endforeach()
include(CPack)
