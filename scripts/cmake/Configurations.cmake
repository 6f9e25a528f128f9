# SPDX-License-Identifier: Apache-2.0
# The configurations of engine and chip (PSWEEP_ENGINE_.., PSWEEP_CHIP_..), read again when one is added or changed.
# Globs on purpose: a user's one has to be found without editing a list.
set(own)
if(PSWEEP_SWEEP)
  set(own --own)
endif()
file(GLOB config_files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/rtl/configs/*.json
     ${PROJECT_SOURCE_DIR}/rtl/configs/*/*.json ${PROJECT_BINARY_DIR}/configs/*.json ${PROJECT_BINARY_DIR}/chips/*.json)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${config_files}
                                       ${PROJECT_SOURCE_DIR}/scripts/configurations.py)
if(PSWEEP_RTL)
  execute_process(
    COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/scripts/configurations.py cmake --build ${PROJECT_BINARY_DIR}
            ${own} ${PROJECT_BINARY_DIR}/configurations.cmake COMMAND_ERROR_IS_FATAL ANY)
  include(${PROJECT_BINARY_DIR}/configurations.cmake)
endif()
