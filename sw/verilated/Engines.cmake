# SPDX-License-Identifier: Apache-2.0
# One Verilated engine per configuration, all of them behind verilated/rtl_engine.hpp: engine_libraries.
# Configurations: rtl/configs/engine/*.json, and <build>/configs/*.json, which users add with scripts/make_config.cmake.
# Keys as the members of golden::Config; "divider": G_DIVIDER, which changes no result and is no member, 0 if left out;
# "waves": built for tests, with FST tracing; the others are built for speed.

# Globs on purpose: configurations are data, and a user's one has to be found without editing a list.
file(GLOB config_files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/rtl/configs/engine/*.json
     ${PROJECT_BINARY_DIR}/configs/*.json)

if(PSWEEP_SWEEP)
  file(GLOB config_files CONFIGURE_DEPENDS ${PROJECT_BINARY_DIR}/configs/*.json)
endif()
if(NOT PSWEEP_RTL)
  set(config_files)
endif()

set(config_keys img_cols img_rows plane_cols plane_rows planes window pix_bits weight_bits interp_frac mncc_bits
                frac_bits lanes rectified)
set(config_generics G_IMG_COLS G_IMG_ROWS G_PLANE_COLS G_PLANE_ROWS G_PLANES G_WINDOW G_PIX_W G_WEIGHT_W G_INTERP_F
                    G_MNCC_W G_FRAC_W G_LANES G_RECTIFIED)

set(names)
set(engine_libraries)
set(REGISTRY_DECLARATIONS "")
set(REGISTRY_ENTRIES "")
foreach(file IN LISTS config_files)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  get_filename_component(name ${file} NAME_WE)
  if(NOT name MATCHES "^[a-z][a-z0-9_]*$")
    message(FATAL_ERROR "${file}: a configuration's name consists of a-z, 0-9 and _")
  endif()
  if(name IN_LIST names)
    message(FATAL_ERROR "${file}: there is already a configuration ${name} in rtl/configs/engine")
  endif()
  list(APPEND names ${name})
  file(READ ${file} json)
  set(generics)
  set(ENGINE_CONFIG "")
  foreach(key generic IN ZIP_LISTS config_keys config_generics)
    string(JSON value ERROR_VARIABLE problem GET "${json}" ${key})
    if(problem OR NOT value MATCHES "^[0-9]+$")
      message(FATAL_ERROR "${file}: ${key} is missing or not a number")
    endif()
    list(APPEND generics ${generic}=${value})
    string(APPEND ENGINE_CONFIG "  c.${key} = ${value};\n")
  endforeach()
  psweep_divider(${file} "${json}" generics)
  string(JSON description ERROR_VARIABLE problem GET "${json}" description)
  if(problem)
    message(FATAL_ERROR "${file}: description is missing")
  endif()
  string(JSON waves ERROR_VARIABLE problem GET "${json}" waves)
  set(purpose FAST)
  if(NOT problem AND waves)
    set(purpose TRACE)
  endif()

  rtl_model(psweep_${name} TOP psweep GENERICS ${generics} ${purpose})
  set(ENGINE_MODEL psweep_${name})
  set(BOTH_EDGES false)
  if(purpose STREQUAL FAST)
    set_target_properties(psweep_${name} PROPERTIES EXCLUDE_FROM_ALL ON)
    set(ENGINE_MODEL fast_psweep_${name})
    set(BOTH_EDGES true)
    rtl_model(${ENGINE_MODEL} TOP psweep GENERICS ${generics} FAST BOTH_EDGES)
  endif()
  set_property(GLOBAL APPEND PROPERTY PSWEEP_ENGINES ${name})  # for tb/replay, as the next one
  set_property(GLOBAL PROPERTY PSWEEP_ENGINE_GENERICS_${name} "${generics}")
  set(ENGINE_NAME ${name})
  configure_file(engine.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/engine_${name}.cpp @ONLY)
  # A library per engine: only its own file may see the Verilated class.
  add_library(psweep_engine_${name} STATIC ${CMAKE_CURRENT_BINARY_DIR}/engine_${name}.cpp)
  target_include_directories(psweep_engine_${name} PRIVATE ${PROJECT_SOURCE_DIR}/sw)
  target_compile_options(psweep_engine_${name} PRIVATE ${PSWEEP_WARNINGS})
  target_link_libraries(psweep_engine_${name} PRIVATE ${ENGINE_MODEL})
  list(APPEND engine_libraries psweep_engine_${name})
  string(APPEND REGISTRY_DECLARATIONS
         "golden::Config config_of_${name}();\nstd::unique_ptr<EngineModel> make_${name}();\n")
  string(APPEND REGISTRY_ENTRIES
         "      {\"${name}\", R\"(${description})\", config_of_${name}(), &make_${name}},\n")
endforeach()
configure_file(engine_registry.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/engine_registry.cpp @ONLY)
