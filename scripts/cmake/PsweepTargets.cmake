# SPDX-License-Identifier: Apache-2.0
# Target helpers shared by all CMakeLists of the project.
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(Python3 REQUIRED COMPONENTS Interpreter)

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

# Targets of our own compile without warnings and link what their folder includes, no more and no less
# (scripts/tools.py arrows). What is not psweep::<library> in the lists below is not ours: packages, Verilated models.

# psweep_library(<name> [SOURCES ..] [PUBLIC ..] [PRIVATE ..]): the library of a folder, psweep_<name>, to be linked as
# psweep::<name>. PUBLIC: what its headers include; PRIVATE: what only its sources do. Includes are relative to sw/ or
# tb/. Without SOURCES it is header-only.
function(psweep_library name)
  cmake_parse_arguments(A "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  file(RELATIVE_PATH tree ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX MATCH "^[^/]+" tree ${tree})
  if(A_SOURCES)
    set(scope PUBLIC)
    add_library(psweep_${name} STATIC ${A_SOURCES})
    target_compile_options(psweep_${name} PRIVATE ${PSWEEP_WARNINGS})
    target_link_libraries(psweep_${name} PRIVATE ${A_PRIVATE})
  else()
    set(scope INTERFACE)
    add_library(psweep_${name} INTERFACE)
  endif()
  target_include_directories(psweep_${name} ${scope} ${PROJECT_SOURCE_DIR}/${tree})
  target_link_libraries(psweep_${name} ${scope} ${A_PUBLIC})
  add_library(psweep::${name} ALIAS psweep_${name})
endfunction()

# psweep_program(<name> SOURCES .. LIBS .. [AT_TOP] [ON_REQUEST]). AT_TOP: it lies in the build folder itself.
# ON_REQUEST: built only if it is asked for.
function(psweep_program name)
  cmake_parse_arguments(A "AT_TOP;ON_REQUEST" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/sw)
  target_compile_options(${name} PRIVATE ${PSWEEP_WARNINGS})
  target_link_libraries(${name} PRIVATE ${A_LIBS})
  if(A_AT_TOP)
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
  endif()
  if(A_ON_REQUEST)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()

# psweep_test(<name> SOURCES .. LIBS ..): Catch2 test program with its own main from Catch2, one ctest entry per case.
# A case that asserts nothing fails, and so does a name that matches no case. A case whose data is absent prints
# 'SKIPPED: <reason>' and then calls SUCCEED(): it is counted as skipped (scripts/tools.py sim).
function(psweep_test name)
  cmake_parse_arguments(A "" "" "SOURCES;LIBS;DEFINITIONS;LABELS" ${ARGN})
  psweep_program(${name} SOURCES ${A_SOURCES} LIBS ${A_LIBS} psweep_catch)
  target_compile_definitions(${name} PRIVATE ${A_DEFINITIONS})
  # Not Catch's own --warn NoAssertions: it asks for assertions in every section as well.
  catch_discover_tests(
    ${name}
    TEST_PREFIX "${name}: "
    PROPERTIES LABELS "${A_LABELS}" SKIP_REGULAR_EXPRESSION "SKIPPED:"
               FAIL_REGULAR_EXPRESSION "No tests ran|assertions: - none -")
endfunction()
