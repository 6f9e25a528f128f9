# SPDX-License-Identifier: Apache-2.0
# cmake -D OBJ=<dir> -D FAST=<file> -D SLOW=<file> [-D INPUTS=ON] -P VerilatedUnity.cmake
# Verilator decides how many C++ files it writes; CMake must know its sources beforehand. So two files include them
# all: FAST the code of every clock, SLOW the rest (constructors, reset, tracing declarations).
# INPUTS: what depends on inputs is evaluated only while psweep_inputs_changed (inputs_changed.cpp). Verilator does it
# before every edge, which is a fifth of the time of an engine that sweeps. A version that writes it in another way is
# an error: the condition has to be written in its way here.
file(GLOB files RELATIVE ${OBJ} ${OBJ}/*.cpp)
list(SORT files)
if(NOT files)
  message(FATAL_ERROR "Verilator wrote no C++ into ${OBJ}")
endif()
set(fast "")
if(INPUTS)
  set(fast "extern __thread bool psweep_inputs_changed;\n")
  set(conditional OFF)
  foreach(file IN LISTS files)
    file(READ ${OBJ}/${file} text)
    # Verilator 5.006, 5.020 and later, 5.032.
    string(REGEX REPLACE "(VicoTriggered\\.(at\\(0U\\) = |set(Bit)?\\(0U, )\
(\\(0U == vlSelf->__VicoIterCount\\)|\\(IData\\)\\(vlSelfRef\\.__VicoFirstIteration\\)))"
                         "\\1 && psweep_inputs_changed" edited "${text}")
    if(NOT edited STREQUAL text)
      file(WRITE ${OBJ}/${file} "${edited}")
      set(conditional ON)
    endif()
  endforeach()
  if(NOT conditional)
    message(FATAL_ERROR "${OBJ}: Verilator's code for what depends on inputs is not as VerilatedUnity.cmake knows it")
  endif()
endif()
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
