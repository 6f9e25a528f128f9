# SPDX-License-Identifier: Apache-2.0
# cmake -D GHDL=.. -D STANDARD=.. -D SOURCES=a|b -D BENCH=.. -D FILE=.. -D DIR=.. -P Replay.cmake
# Analyses the original VHDL and the bench, replays FILE, prints the bench's report. Fails with it.
# Generics are those in FILE. Memories start with 'U' here: their start value (rtl/ram_*.vhd) would hide a word that is
# used before it was written.
include(${CMAKE_CURRENT_LIST_DIR}/../../scripts/cmake/EditedSources.cmake)
string(REPLACE "|" ";" SOURCES "${SOURCES}")
file(REMOVE_RECURSE ${DIR})
file(MAKE_DIRECTORY ${DIR})
edited_sources(analysed ${DIR}
               "-- synthesis translate_off[ \n]*:= [(]others => [(][^\n]*[ \n]*-- synthesis translate_on" ""
               "signal memory :" ${SOURCES})
execute_process(COMMAND ${GHDL} -a ${STANDARD} --workdir=${DIR} ${analysed} ${BENCH} RESULT_VARIABLE code
                ERROR_VARIABLE log)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "GHDL does not analyse the sources:\n${log}")
endif()

file(STRINGS ${FILE} generics REGEX "^generic ")
list(TRANSFORM generics REPLACE "^generic ([^ ]+) ([^ ]+)$" "-g\\1=\\2")
get_filename_component(bench ${BENCH} NAME_WE)
# The arithmetic packages warn of unknown bits before the reset and in RAM words that nobody uses.
execute_process(
  COMMAND ${GHDL} -r ${STANDARD} --workdir=${DIR} ${bench} ${generics} -gG_FILE=${FILE} --ieee-asserts=disable
  RESULT_VARIABLE code OUTPUT_VARIABLE log ERROR_VARIABLE log)
message("${log}")
if(NOT code EQUAL 0 OR NOT log MATCHES "replay: [1-9][0-9]* steps, [1-9][0-9]* values compared, 0 differences")
  message(FATAL_ERROR "the replay failed")
endif()
