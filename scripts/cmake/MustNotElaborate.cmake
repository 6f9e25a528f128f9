# SPDX-License-Identifier: Apache-2.0
# cmake -D GHDL= -D STANDARD= -D TOP= -D SOURCES=a|b -D GENERICS=-gK=V|.. -D MESSAGE=<regex> -D DIR=<scratch>
#       -P MustNotElaborate.cmake
# The value that MESSAGE names is for simulators only (translate_off); as a synthesis tool GHDL leaves it out.
# Succeeds if GHDL refuses to elaborate TOP with these generics and says why in the words of MESSAGE; without a MESSAGE
# if it does not refuse.
string(REPLACE "|" ";" SOURCES "${SOURCES}")
string(REPLACE "|" ";" GENERICS "${GENERICS}")
file(MAKE_DIRECTORY ${DIR})
execute_process(COMMAND ${GHDL} -a ${STANDARD} --workdir=${DIR} ${SOURCES} COMMAND_ERROR_IS_FATAL ANY)
execute_process(
  COMMAND ${GHDL} --synth ${STANDARD} --workdir=${DIR} ${GENERICS} --out=none ${TOP}
  RESULT_VARIABLE code
  OUTPUT_VARIABLE text
  ERROR_VARIABLE text)
if(NOT MESSAGE)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${TOP} with ${GENERICS} did not elaborate:\n${text}")
  endif()
  return()
endif()
if(code EQUAL 0)
  message(FATAL_ERROR "${TOP} elaborated with ${GENERICS}, but must not")
endif()
string(REGEX REPLACE "=-?[0-9]+ " "(=-?[0-9]+)? " MESSAGE "${MESSAGE}")
if(NOT text MATCHES "${MESSAGE}")
  message(FATAL_ERROR "${TOP} with ${GENERICS}: expected a message matching '${MESSAGE}', got:\n${text}")
endif()
