# SPDX-License-Identifier: Apache-2.0
# One Verilated psweep_top per configuration, all of them behind verilated/chips.hpp: chip_libraries.
# Configurations: rtl/configs/chip/*.json, and <build>/chips/*.json of the user; "engine" names one of an engine.
# scripts/configurations.py reads and checks them. With "waves" built with FST tracing.
set(PSWEEP_CHIPS "" CACHE STRING "The only chips that are built (scripts/mutants.sh); default: all")
set(chips ${PSWEEP_CHIP_NAMES})
if(PSWEEP_CHIPS)
  set(chips ${PSWEEP_CHIPS})
endif()
set(chip_libraries)
set(REGISTRY_DECLARATIONS "")
set(entries)
foreach(CHIP_NAME IN LISTS chips)
  set(engine "${PSWEEP_CHIP_${CHIP_NAME}_ENGINE}")
  set(description "${PSWEEP_CHIP_${CHIP_NAME}_DESCRIPTION}")
  set(generics ${PSWEEP_CHIP_${CHIP_NAME}_GENERICS})
  set(ARBITER_CONFIG "${PSWEEP_CHIP_${CHIP_NAME}_VALUES}")
  set(ENGINE_CONFIG "${PSWEEP_CHIP_${CHIP_NAME}_ENGINE_VALUES}")
  set(purpose FAST)
  set(has_waves false)
  if(PSWEEP_CHIP_${CHIP_NAME}_WAVES AND ZLIB_FOUND)
    list(APPEND purpose TRACE)
    set(has_waves true)
  endif()

  rtl_model(chip_${CHIP_NAME} TOP psweep_top GENERICS ${generics} ${purpose})
  configure_file(chip.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/chip_${CHIP_NAME}.cpp @ONLY)
  # A library per chip: only its own file may see the Verilated class.
  add_library(psweep_chip_${CHIP_NAME} STATIC ${CMAKE_CURRENT_BINARY_DIR}/chip_${CHIP_NAME}.cpp)
  target_include_directories(psweep_chip_${CHIP_NAME} PRIVATE ${PROJECT_SOURCE_DIR}/sw)
  target_compile_options(psweep_chip_${CHIP_NAME} PRIVATE ${PSWEEP_WARNINGS})
  target_link_libraries(psweep_chip_${CHIP_NAME} PRIVATE chip_${CHIP_NAME})
  list(APPEND chip_libraries psweep_chip_${CHIP_NAME})
  string(APPEND REGISTRY_DECLARATIONS
         "net::ArbiterConfig config_of_${CHIP_NAME}();\nstd::unique_ptr<ChipModel> make_${CHIP_NAME}();\n")
  list(APPEND entries "      {\"${CHIP_NAME}\", R\"(${description})\",\n"
       "       \"${engine}\", config_of_${CHIP_NAME}(), net::address_of(config_of_${CHIP_NAME}()), ${has_waves}, "
       "&make_${CHIP_NAME}},\n")
endforeach()
list(JOIN entries "" REGISTRY_ENTRIES)
configure_file(chip_registry.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/chip_registry.cpp @ONLY)
