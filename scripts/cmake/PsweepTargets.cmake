# SPDX-License-Identifier: Apache-2.0
# Target helpers shared by all CMakeLists of the project.
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)

# OpenCV modules by hand: OpenCVConfig.cmake comes only with Debian's libopencv-dev, ten times the size of the four
# modules used here.
find_path(OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
find_path(OPENCV_ARCH_INCLUDE opencv2/opencv_modules.hpp PATH_SUFFIXES ${CMAKE_LIBRARY_ARCHITECTURE}/opencv4 opencv4)
foreach(module core imgproc imgcodecs calib3d)
  find_library(OPENCV_${module} opencv_${module} REQUIRED)
  add_library(OpenCV::${module} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(OpenCV::${module} PROPERTIES IMPORTED_LOCATION ${OPENCV_${module}})
  target_include_directories(OpenCV::${module} SYSTEM INTERFACE ${OPENCV_INCLUDE})
  if(OPENCV_ARCH_INCLUDE)
    target_include_directories(OpenCV::${module} SYSTEM INTERFACE ${OPENCV_ARCH_INCLUDE})
  endif()
endforeach()

set(PSWEEP_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror)

# psweep_library(<name> SOURCES .. LIBS ..): library of our own, headers relative to sw/, warnings are errors.
# Without SOURCES it is header-only.
function(psweep_library name)
  cmake_parse_arguments(A "" "" "SOURCES;LIBS" ${ARGN})
  if(A_SOURCES)
    add_library(${name} STATIC ${A_SOURCES})
    target_include_directories(${name} PUBLIC ${CMAKE_SOURCE_DIR}/sw)
    target_compile_options(${name} PRIVATE ${PSWEEP_WARNINGS})
    target_link_libraries(${name} PUBLIC ${A_LIBS})
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE ${CMAKE_SOURCE_DIR}/sw)
    target_link_libraries(${name} INTERFACE ${A_LIBS})
  endif()
endfunction()

# psweep_test(<name> SOURCES .. LIBS ..): Catch2 test program with its own main from Catch2, one ctest entry per case.
# A case that asserts nothing fails, and so does a name that matches no case. A case whose data is absent prints
# 'SKIPPED: <reason>' and then calls SUCCEED(): it is counted as skipped (scripts/summary.sh).
function(psweep_test name)
  cmake_parse_arguments(A "" "" "SOURCES;LIBS;DEFINITIONS;LABELS" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/tb ${CMAKE_SOURCE_DIR}/sw)
  target_compile_options(${name} PRIVATE ${PSWEEP_WARNINGS})
  target_compile_definitions(${name} PRIVATE ${A_DEFINITIONS})
  target_link_libraries(${name} PRIVATE ${A_LIBS} psweep_catch)
  # Not Catch's own --warn NoAssertions: it asks for assertions in every section as well.
  catch_discover_tests(
    ${name}
    TEST_PREFIX "${name}: "
    PROPERTIES LABELS "${A_LABELS}" SKIP_REGULAR_EXPRESSION "SKIPPED:"
               FAIL_REGULAR_EXPRESSION "No tests ran|assertions: - none -")
endfunction()

if(PSWEEP_TESTS)
  # Debian 12 has Catch2 2 (one header), Debian 13 Catch2 3 (library); "support/catch.hpp" hides the difference.
  find_package(Catch2 REQUIRED)
  include(Catch)
  add_library(psweep_catch INTERFACE)
  if(Catch2_VERSION VERSION_GREATER_EQUAL 3)
    target_compile_definitions(psweep_catch INTERFACE PSWEEP_CATCH2_V3)
    target_link_libraries(psweep_catch INTERFACE Catch2::Catch2WithMain)
  else()
    add_library(psweep_catch_main STATIC ${CMAKE_SOURCE_DIR}/tb/support/catch_main.cpp)
    target_link_libraries(psweep_catch_main PUBLIC Catch2::Catch2)
    target_link_libraries(psweep_catch INTERFACE psweep_catch_main)
  endif()
endif()

# Appends G_DIVIDER=.. of an engine's configuration to the list; without the key it is 0.
function(psweep_divider file json list)
  string(JSON value ERROR_VARIABLE problem GET "${json}" divider)
  if(problem)
    set(value 0)
  elseif(NOT value MATCHES "^[0-9]+$")
    message(FATAL_ERROR "${file}: divider is not a number")
  endif()
  list(APPEND ${list} G_DIVIDER=${value})
  set(${list} "${${list}}" PARENT_SCOPE)
endfunction()
