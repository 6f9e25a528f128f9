# SPDX-License-Identifier: Apache-2.0
# VHDL entity + generics -> Verilated C++ library.
#
#   rtl_model(<name> TOP <entity> [GENERICS K=V ...] [TRACE] [FAST] [BOTH_EDGES] [AS_SYNTHESIZED] [UPSETS <option> ..])
#     Static library <name> with header V<name>.h (class V<name>) for an entity of rtl/files.f. TRACE: the model can
#     write FST waves (costs nothing until a file is opened, but longer compilation). FAST: compiled for long runs.
#     BOTH_EDGES: every change of clk is a clock, so that a clock is one evaluation (for entities with one clock).
#     AS_SYNTHESIZED: a word that a RAM reads while it is written is what the template says, not random.
#     UPSETS: registers can be upset: options of `scripts/tools.py upsets`, which writes <name>.inc as well.
#   rtl_must_not_elaborate(<test> TOP <entity> GENERICS K=V ... MESSAGE <regex>)
#     ctest case: elaboration with these generics has to fail, and the message has to match. Without MESSAGE it has to
#     succeed.
#
# rtl/files.f is the one compile order: paths relative to rtl/, '#' starts a comment. A model depends on the files up
# to and including its own entity, and is Verilated again only if the Verilog text that GHDL makes of them changes.
#
# Verilator's own verilate() runs at configure time, when the Verilog does not exist yet; and its Makefile would need
# make and Python. So Verilator only writes C++ here, and CMake compiles that (with its jobs, its ccache).
find_program(PSWEEP_GHDL ghdl REQUIRED)
find_program(PSWEEP_VERILATOR verilator REQUIRED)
find_program(PSWEEP_PYTHON python3 REQUIRED)
set(PSWEEP_TOOLS ${PROJECT_SOURCE_DIR}/scripts/tools.py)
find_package(ZLIB)
execute_process(
  COMMAND ${PSWEEP_VERILATOR} --getenv VERILATOR_ROOT
  OUTPUT_VARIABLE PSWEEP_VERILATOR_ROOT
  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)

set(PSWEEP_VHDL_STANDARD --std=93)
# For builds with a purpose of their own (scripts/mutants.sh, scripts/coverage.sh).
set(PSWEEP_VERILATOR_EXTRA "" CACHE STRING "Further options of Verilator")
set(PSWEEP_FAST_OPTION -O3 CACHE STRING "Optimisation of models that are built for long runs")
option(PSWEEP_COVERAGE "Models count which bits change (sw/simulator/coverage.hpp)" OFF)
set(PSWEEP_RTL_MODEL_DIR ${CMAKE_CURRENT_LIST_DIR})
# -Wall and every warning is an error, but for the waivers of ghdl_netlist.vlt.
set(PSWEEP_VERILATOR_FLAGS -Wall -O3 --x-initial unique --x-assign unique ${PSWEEP_VERILATOR_EXTRA})

include(CheckCXXCompilerFlag)
check_cxx_compiler_flag("--param=max-rtl-if-conversion-unpredictable-cost=200" PSWEEP_HAVE_IF_CONVERSION)
set(PSWEEP_NO_BRANCHES)
if(PSWEEP_HAVE_IF_CONVERSION)
  set(PSWEEP_NO_BRANCHES --param=max-rtl-if-conversion-unpredictable-cost=200
                         --param=max-rtl-if-conversion-predictable-cost=200)
endif()

set(coverage_source)
if(PSWEEP_COVERAGE)
  list(APPEND PSWEEP_VERILATOR_FLAGS --coverage-toggle --coverage-underscore)
  set(coverage_source ${PSWEEP_VERILATOR_ROOT}/include/verilated_cov.cpp)
endif()

# Newer versions print a page of statistics for every model.
execute_process(COMMAND ${PSWEEP_VERILATOR} --version OUTPUT_VARIABLE PSWEEP_VERILATOR_VERSION)
string(REGEX MATCH "[0-9]+\\.[0-9]+" PSWEEP_VERILATOR_VERSION "${PSWEEP_VERILATOR_VERSION}")
if(PSWEEP_VERILATOR_VERSION VERSION_GREATER_EQUAL 5.030)
  list(APPEND PSWEEP_VERILATOR_FLAGS --quiet-stats)
endif()

# The run-time library comes with Verilator as source.
add_library(verilated_rt STATIC ${PSWEEP_VERILATOR_ROOT}/include/verilated.cpp
                                ${PSWEEP_VERILATOR_ROOT}/include/verilated_threads.cpp ${coverage_source}
                                ${PSWEEP_RTL_MODEL_DIR}/inputs_changed.cpp)
target_include_directories(verilated_rt SYSTEM PUBLIC ${PSWEEP_VERILATOR_ROOT}/include
                                                      ${PSWEEP_VERILATOR_ROOT}/include/vltstd)
target_compile_definitions(verilated_rt PUBLIC VM_COVERAGE=$<BOOL:${PSWEEP_COVERAGE}> VM_SC=0)
target_link_libraries(verilated_rt PUBLIC Threads::Threads)
if(ZLIB_FOUND)
  add_library(verilated_rt_fst STATIC ${PSWEEP_VERILATOR_ROOT}/include/verilated_fst_c.cpp)
  target_compile_definitions(verilated_rt_fst PUBLIC VM_TRACE=1 VM_TRACE_FST=1)
  target_compile_options(verilated_rt_fst PRIVATE -w)  # not ours
  target_link_libraries(verilated_rt_fst PUBLIC verilated_rt ZLIB::ZLIB)
else()
  message(STATUS "psweep: zlib not found, models are built without waves")
endif()

# psweep_tool_files(<out> <subpackage> ..): Python files that a command of scripts/tools.py depends on.
function(psweep_tool_files out)
  list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/scripts/psweep_tools/)
  list(TRANSFORM ARGN APPEND /*.py)
  file(GLOB files ${PROJECT_SOURCE_DIR}/scripts/psweep_tools/*.py ${ARGN})
  list(FILTER files EXCLUDE REGEX "/cli\\.py$")
  set(${out} ${files} PARENT_SCOPE)
endfunction()

# Files of rtl/files.f up to and including <entity>.vhd, as absolute paths in `out`.
function(psweep_rtl_sources entity out)
  set(list_file ${CMAKE_SOURCE_DIR}/rtl/files.f)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${list_file})
  file(STRINGS ${list_file} lines REGEX "^[^#]")
  set(sources)
  foreach(line IN LISTS lines)
    string(STRIP "${line}" line)
    if(line STREQUAL "")
      continue()
    endif()
    list(APPEND sources ${CMAKE_SOURCE_DIR}/rtl/${line})
    get_filename_component(unit ${line} NAME_WE)
    if(unit STREQUAL entity)
      set(${out} ${sources} PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "rtl/files.f has no file ${entity}.vhd")
endfunction()

# The file of an entity, by rtl/files.f.
function(psweep_rtl_file entity out)
  psweep_rtl_sources(${entity} sources)
  list(GET sources -1 file)
  set(${out} ${file} PARENT_SCOPE)
endfunction()

function(rtl_model name)
  cmake_parse_arguments(A "TRACE;FAST;BOTH_EDGES;AS_SYNTHESIZED" "TOP" "GENERICS;UPSETS" ${ARGN})
  psweep_rtl_sources(${A_TOP} sources)
  set(dir ${CMAKE_CURRENT_BINARY_DIR}/${name})
  set(obj ${dir}/obj)
  list(TRANSFORM A_GENERICS PREPEND -g)
  set(flags ${PSWEEP_VERILATOR_FLAGS})
  set(fast_options -O1)
  if(A_FAST)
    # Unknown values are constants instead of random numbers that have to be carried along, and what depends on data
    # (the digits of the dividers) is chosen without branches, which no processor can predict.
    list(APPEND flags --x-assign fast)
    set(fast_options ${PSWEEP_FAST_OPTION} ${PSWEEP_NO_BRANCHES})
  endif()
  set(trace_flag)
  if(A_TRACE AND ZLIB_FOUND)
    set(trace_flag --trace-fst)
  endif()

  set(upset_tool)
  if(A_UPSETS)
    psweep_tool_files(upset_tool upsets vhdl)
  endif()
  string(REPLACE ";" "|" upsets "${A_UPSETS}")
  string(REPLACE ";" "|" source_list "${sources}")
  string(REPLACE ";" "|" generic_list "${A_GENERICS}")
  add_custom_command(
    OUTPUT ${dir}/${A_TOP}.v
    COMMAND
      ${CMAKE_COMMAND} -D GHDL=${PSWEEP_GHDL} -D STANDARD=${PSWEEP_VHDL_STANDARD} -D TOP=${A_TOP} -D
      SOURCES=${source_list} -D GENERICS=${generic_list} -D DIR=${dir} -D BOTH_EDGES=${A_BOTH_EDGES}
      -D AS_SYNTHESIZED=${A_AS_SYNTHESIZED} -D UPSETS=${upsets} -D SITES=${dir}/${name}.inc -D PYTHON=${PSWEEP_PYTHON}
      -P ${PSWEEP_RTL_MODEL_DIR}/VhdlToVerilog.cmake
    DEPENDS ${sources} ${PSWEEP_RTL_MODEL_DIR}/VhdlToVerilog.cmake ${PSWEEP_RTL_MODEL_DIR}/EditedSources.cmake
            ${upset_tool}
    COMMENT "GHDL ${name}"
    VERBATIM)
  set(waivers ${PSWEEP_RTL_MODEL_DIR}/ghdl_netlist.vlt)
  set(header ${obj}/V${name}.h)
  set(fast ${obj}/V${name}__fast.cxx)
  set(slow ${obj}/V${name}__slow.cxx)
  add_custom_command(
    OUTPUT ${header} ${fast} ${slow}
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${obj}
    COMMAND ${PSWEEP_VERILATOR} --cc ${flags} ${trace_flag} --prefix V${name} --Mdir ${obj}
            --top-module ${A_TOP} ${waivers} ${dir}/${A_TOP}.v
    COMMAND ${CMAKE_COMMAND} -D OBJ=${obj} -D FAST=${fast} -D SLOW=${slow}
            -D INPUTS=${A_BOTH_EDGES} -P ${PSWEEP_RTL_MODEL_DIR}/VerilatedUnity.cmake
    DEPENDS ${dir}/${A_TOP}.v ${waivers} ${PSWEEP_RTL_MODEL_DIR}/VerilatedUnity.cmake
    COMMENT "Verilator ${name}"
    VERBATIM)

  add_library(${name} STATIC ${fast} ${slow} ${header})
  # Constructors and reset code run once: compiling them without optimisation halves the build.
  set_source_files_properties(${fast} PROPERTIES COMPILE_OPTIONS "${fast_options}")
  set_source_files_properties(${slow} PROPERTIES COMPILE_OPTIONS "-O0")
  target_compile_options(${name} PRIVATE -w)  # generated code
  target_include_directories(${name} SYSTEM PUBLIC ${obj})
  if(trace_flag)
    target_link_libraries(${name} PUBLIC verilated_rt_fst)
  else()
    target_link_libraries(${name} PUBLIC verilated_rt)
  endif()
endfunction()

function(rtl_must_not_elaborate test)
  cmake_parse_arguments(A "" "TOP;MESSAGE" "GENERICS" ${ARGN})
  psweep_rtl_sources(${A_TOP} sources)
  list(TRANSFORM A_GENERICS PREPEND -g)
  string(REPLACE ";" "|" sources "${sources}")
  string(REPLACE ";" "|" generics "${A_GENERICS}")
  add_test(
    NAME ${test}
    COMMAND
      ${CMAKE_COMMAND} -D GHDL=${PSWEEP_GHDL} -D STANDARD=${PSWEEP_VHDL_STANDARD} -D TOP=${A_TOP} -D
      SOURCES=${sources} -D GENERICS=${generics} -D MESSAGE=${A_MESSAGE} -D
      DIR=${CMAKE_CURRENT_BINARY_DIR}/must_not_elaborate/${test} -P ${PSWEEP_RTL_MODEL_DIR}/MustNotElaborate.cmake)
  set_tests_properties(${test} PROPERTIES LABELS unit)
endfunction()
