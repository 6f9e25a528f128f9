# SPDX-License-Identifier: Apache-2.0
# One Verilated engine per configuration, all of them behind verilated/rtl_engine.hpp: engine_libraries.
# Configurations: rtl/configs/engine/*.json, and <build>/configs/*.json, which users add with `make config`;
# scripts/configurations.py reads and checks them. With "waves" built for tests, with FST tracing; else for speed.
set(engine_libraries)
set(REGISTRY_DECLARATIONS "")
set(REGISTRY_ENTRIES "")
foreach(ENGINE_NAME IN LISTS PSWEEP_ENGINE_NAMES)
  set(description "${PSWEEP_ENGINE_${ENGINE_NAME}_DESCRIPTION}")
  set(ENGINE_CONFIG "${PSWEEP_ENGINE_${ENGINE_NAME}_VALUES}")
  set(generics ${PSWEEP_ENGINE_${ENGINE_NAME}_GENERICS})
  set(purpose FAST)
  if(PSWEEP_ENGINE_${ENGINE_NAME}_WAVES)
    set(purpose TRACE)
  endif()

  rtl_model(psweep_${ENGINE_NAME} TOP psweep GENERICS ${generics} ${purpose})
  set(ENGINE_MODEL psweep_${ENGINE_NAME})
  set(BOTH_EDGES false)
  if(purpose STREQUAL FAST)
    set_target_properties(psweep_${ENGINE_NAME} PROPERTIES EXCLUDE_FROM_ALL ON)
    set(ENGINE_MODEL fast_psweep_${ENGINE_NAME})
    set(BOTH_EDGES true)
    rtl_model(${ENGINE_MODEL} TOP psweep GENERICS ${generics} FAST BOTH_EDGES)
  endif()
  configure_file(engine.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/engine_${ENGINE_NAME}.cpp @ONLY)
  # A library per engine: only its own file may see the Verilated class.
  add_library(psweep_engine_${ENGINE_NAME} STATIC ${CMAKE_CURRENT_BINARY_DIR}/engine_${ENGINE_NAME}.cpp)
  target_include_directories(psweep_engine_${ENGINE_NAME} PRIVATE ${PROJECT_SOURCE_DIR}/sw)
  target_compile_options(psweep_engine_${ENGINE_NAME} PRIVATE ${PSWEEP_WARNINGS})
  target_link_libraries(psweep_engine_${ENGINE_NAME} PRIVATE ${ENGINE_MODEL})
  list(APPEND engine_libraries psweep_engine_${ENGINE_NAME})
  string(APPEND REGISTRY_DECLARATIONS
         "golden::Config config_of_${ENGINE_NAME}();\nstd::unique_ptr<EngineModel> make_${ENGINE_NAME}();\n")
  string(APPEND REGISTRY_ENTRIES
         "      {\"${ENGINE_NAME}\", R\"(${description})\", config_of_${ENGINE_NAME}(), &make_${ENGINE_NAME}},\n")
endforeach()
configure_file(engine_registry.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/engine_registry.cpp @ONLY)
