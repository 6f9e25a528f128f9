# SPDX-License-Identifier: Apache-2.0
# cmake -D GHDL=.. -D STANDARD=.. -D SOURCES=a|b -D BENCH=.. -D GENERICS=K=V|K=V -D FILE=.. -D DIR=.. -P Replay.cmake
# Analyses the original VHDL and the bench, replays FILE, prints the bench's report. Fails with it.
string(REPLACE "|" ";" SOURCES "${SOURCES}")
string(REPLACE "|" ";" GENERICS "${GENERICS}")
list(TRANSFORM GENERICS PREPEND -g)
file(REMOVE_RECURSE ${DIR})
file(MAKE_DIRECTORY ${DIR})
execute_process(COMMAND ${GHDL} -a ${STANDARD} --workdir=${DIR} ${SOURCES} ${BENCH} RESULT_VARIABLE code
                ERROR_VARIABLE log)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "GHDL does not analyse the sources:\n${log}")
endif()
# The arithmetic packages warn of unknown bits before the reset and in RAM words that nobody uses.
execute_process(
  COMMAND ${GHDL} -r ${STANDARD} --workdir=${DIR} psweep_replay ${GENERICS} -gG_FILE=${FILE} --ieee-asserts=disable
  RESULT_VARIABLE code OUTPUT_VARIABLE log ERROR_VARIABLE log)
message("${log}")
if(NOT code EQUAL 0 OR NOT log MATCHES "replay: [1-9][0-9]* tx edges.* 0 differences")
  message(FATAL_ERROR "the replay failed")
endif()
