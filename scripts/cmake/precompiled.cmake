# The large headers, read once instead of in every object: most of a build from nothing is reading them. Two sets, so that core and drivers
# cannot come to lean on what only app/ may include; other builds go without, and find what a file forgot to include.
if(NOT VERGENCE_PRECOMPILED_HEADERS)
  return()
endif()

find_package(CLI11 2.1 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)

set(standard_headers
  <algorithm> <array> <atomic> <cassert> <chrono> <cmath> <condition_variable> <cstdint> <cstring> <functional> <limits> <map> <memory> <mutex>
  <numbers> <optional> <span> <string> <string_view> <thread> <utility> <vector>)
set(eigen_headers <Eigen/Core> <Eigen/Cholesky> <Eigen/Eigenvalues> <Eigen/Geometry> <Eigen/LU> <Eigen/QR> <Eigen/SVD>)
set(app_headers <filesystem> <fstream> <iostream> <sstream> <CLI/App.hpp> <CLI/Config.hpp> <CLI/Formatter.hpp> <fmt/format.h> <nlohmann/json.hpp>
  <yaml-cpp/yaml.h>)

# The compiler takes a precompiled header only with the macros it was made with, and some device libraries come with this one.
target_compile_options(vergence_options INTERFACE -pthread)

file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled.cpp CONTENT "// A library needs a source.\n")
add_library(vergence_precompiled_core STATIC ${PROJECT_BINARY_DIR}/precompiled.cpp)
target_link_libraries(vergence_precompiled_core PRIVATE vergence_options Eigen3::Eigen)
target_precompile_headers(vergence_precompiled_core PRIVATE ${standard_headers} ${eigen_headers})
add_library(vergence_precompiled_app STATIC ${PROJECT_BINARY_DIR}/precompiled.cpp)
target_link_libraries(vergence_precompiled_app PRIVATE vergence_options Eigen3::Eigen CLI11::CLI11 fmt::fmt nlohmann_json::nlohmann_json yaml-cpp)
target_precompile_headers(vergence_precompiled_app PRIVATE ${standard_headers} ${eigen_headers} ${app_headers})

# vergence_precompiled(TARGET): by the room's name.
function(vergence_precompiled target)
  if(target MATCHES "^vergence_app_")
    target_precompile_headers(${target} REUSE_FROM vergence_precompiled_app)
  elseif(target MATCHES "^vergence_(core|drivers)_?")
    target_precompile_headers(${target} REUSE_FROM vergence_precompiled_core)
  endif()
endfunction()
