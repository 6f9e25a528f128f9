# SPDX-License-Identifier: Apache-2.0
# cmake -D GHDL= -D STANDARD= -D TOP= -D SOURCES=a|b -D GENERICS=-gK=V|.. -D DIR=<work folder> [-D BOTH_EDGES=ON]
#       [-D AS_SYNTHESIZED=ON] [-D UPSETS=option|.. -D SITES=<file> -D PYTHON=] -P VhdlToVerilog.cmake
# UPSETS: registers that can be upset, by scripts/tools.py upsets, which lists them in SITES.
# Writes DIR/TOP.v. The file keeps its time stamp if the text did not change, so nothing is Verilated for a comment.
# What stands between translate_off and translate_on behind a comment '-- collision:' is translated all the same: a
# word that a RAM reads while it is written is random in the models, as it is 'X' in the VHDL, not the old one of the
# template that synthesis tools see. Such files are copied into DIR. With AS_SYNTHESIZED it is left out, as synthesis
# tools leave it out: GHDL may translate the bare template in another way.
# Shows GHDL's messages if it fails or warns; its notes ("found RAM ..") are left out, as is the warning that attributes
# for the FPGA tools do not reach the Verilog.
include(${CMAKE_CURRENT_LIST_DIR}/EditedSources.cmake)
string(REPLACE "|" ";" SOURCES "${SOURCES}")
string(REPLACE "|" ";" GENERICS "${GENERICS}")
file(MAKE_DIRECTORY ${DIR})
function(run_ghdl)
  cmake_parse_arguments(A "" "OUTPUT" "ARGS" ${ARGN})
  execute_process(
    COMMAND ${GHDL} ${A_ARGS}
    RESULT_VARIABLE code
    OUTPUT_FILE ${A_OUTPUT}
    ERROR_VARIABLE text)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "ghdl ${TOP} ${GENERICS} failed:\n${text}")
  endif()
  string(REGEX REPLACE "[^\n]*:warning: unhandled attribute \"[a-z0-9_]+\"[^\n]*\n[^\n]*\n[^\n]*\n" "" text "${text}")
  if(text MATCHES ":(warning|error)")
    message("${text}")
  endif()
endfunction()
set(models ${SOURCES})
if(NOT AS_SYNTHESIZED)
  edited_sources(models ${DIR} "-- synthesis translate_off\n *-- collision:[^\n]*\n([^-]*)-- synthesis translate_on"
                 "\\1" "-- collision:" ${SOURCES})
endif()
run_ghdl(OUTPUT ${DIR}/analysis.log ARGS -a ${STANDARD} --workdir=${DIR} ${models})
run_ghdl(OUTPUT ${DIR}/raw.v ARGS --synth ${STANDARD} --workdir=${DIR} ${GENERICS} --out=verilog ${TOP})
if(UPSETS)
  string(REPLACE "|" ";" UPSETS "${UPSETS}")
  execute_process(COMMAND ${PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/../tools.py upsets ${DIR}/raw.v ${DIR}/edited.v
                          ${SITES} ${TOP} ${UPSETS} COMMAND_ERROR_IS_FATAL ANY)
  file(RENAME ${DIR}/edited.v ${DIR}/raw.v)
endif()
if(BOTH_EDGES)
  # Registers take their values at both edges of the only clock.
  file(READ ${DIR}/raw.v text)
  string(REPLACE "@(posedge clk)" "@(posedge clk or negedge clk)" text "${text}")
  if(NOT text MATCHES "negedge clk" OR text MATCHES "posedge clk or posedge|always @[(]negedge|posedge [^c]")
    message(FATAL_ERROR "${TOP}: no register of clk found, or one of another clock or with a reset of its own")
  endif()
  file(WRITE ${DIR}/raw.v "${text}")
endif()
file(COPY_FILE ${DIR}/raw.v ${DIR}/${TOP}.v ONLY_IF_DIFFERENT)
