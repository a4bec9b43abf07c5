# OpenCV as Debian's component packages bring it: headers and libraries without a CMake package.
# Makes opencv::NAME for each component of scripts/packages/tests.txt.
find_path(VERGENCE_OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(component core imgproc imgcodecs calib3d video aruco)
  find_library(VERGENCE_OPENCV_${component} opencv_${component} REQUIRED)
  add_library(opencv::${component} UNKNOWN IMPORTED)
  set_target_properties(opencv::${component} PROPERTIES
    IMPORTED_LOCATION ${VERGENCE_OPENCV_${component}}
    INTERFACE_INCLUDE_DIRECTORIES ${VERGENCE_OPENCV_INCLUDE}
    INTERFACE_SYSTEM_INCLUDE_DIRECTORIES ${VERGENCE_OPENCV_INCLUDE})
endforeach()
foreach(component imgproc imgcodecs calib3d video aruco)
  set_target_properties(opencv::${component} PROPERTIES INTERFACE_LINK_LIBRARIES opencv::core)
endforeach()
