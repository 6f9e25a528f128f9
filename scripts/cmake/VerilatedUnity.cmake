# SPDX-License-Identifier: Apache-2.0
# cmake -D OBJ=<dir> -D FAST=<file> -D SLOW=<file> -P VerilatedUnity.cmake
# Verilator decides how many C++ files it writes; CMake must know its sources beforehand. So two files include them
# all: FAST the code of every clock, SLOW the rest (constructors, reset, tracing declarations).
file(GLOB files RELATIVE ${OBJ} ${OBJ}/*.cpp)
list(SORT files)
if(NOT files)
  message(FATAL_ERROR "Verilator wrote no C++ into ${OBJ}")
endif()
set(fast "")
set(slow "")
foreach(file IN LISTS files)
  if(file MATCHES "__Slow\\.cpp$|__Syms\\.cpp$")
    string(APPEND slow "#include \"${file}\"\n")
  else()
    string(APPEND fast "#include \"${file}\"\n")
  endif()
endforeach()
file(WRITE ${FAST} "${fast}")
file(WRITE ${SLOW} "${slow}")
