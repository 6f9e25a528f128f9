# SPDX-License-Identifier: Apache-2.0
# Writes a configuration of the Verilated engine for the next build:
#   cmake -D DIR=build/configs -D NAME=w9 [-D WINDOW=9] [-D PLANE_COLS=256] ... -P scripts/make_config.cmake
# NAME: a-z, 0-9, _. All others are numbers; what is not given (or empty) comes from the defaults below. IMG_COLS and
# IMG_ROWS default to the largest tile with its skirt, plus 2 for interpolation, plus DISPARITY columns (half of the
# difference between the disparities of the nearest and the farthest plane). WAVES=1: for `make waves`; slower.
set(keys PLANE_COLS PLANE_ROWS PLANES WINDOW PIX_BITS WEIGHT_BITS INTERP_FRAC MNCC_BITS FRAC_BITS LANES RECTIFIED
         DIVIDER WAVES)
set(defaults 256 130 301 13 8 8 2 13 8 1 0 0 0)
set(lowest 1 1 1 3 1 1 0 4 2 1 0 0 0)
set(highest 4096 4096 1024 21 12 12 8 16 12 4 1 1 1)

if(NOT DIR)
  message(FATAL_ERROR "make_config: DIR=<folder> is missing")
endif()
if(NOT NAME MATCHES "^[a-z][a-z0-9_]*$")
  message(FATAL_ERROR "make_config: NAME='${NAME}' must consist of a-z, 0-9 and _, and begin with a letter")
endif()

function(check_range key low high)
  if(NOT ${key} MATCHES "^[0-9]+$" OR ${key} LESS low OR ${key} GREATER high)
    message(FATAL_ERROR "make_config: ${key}='${${key}}' is not a number from ${low} to ${high}")
  endif()
endfunction()

foreach(key default low high IN ZIP_LISTS keys defaults lowest highest)
  if("${${key}}" STREQUAL "")
    set(${key} ${default})
  endif()
  check_range(${key} ${low} ${high})
endforeach()
math(EXPR odd "${WINDOW} % 2")
if(NOT odd)
  message(FATAL_ERROR "make_config: WINDOW=${WINDOW} is even")
endif()
if(LANES EQUAL 3)
  message(FATAL_ERROR "make_config: LANES=3 is not 1, 2 or 4")
endif()
if("${DISPARITY}" STREQUAL "")
  set(DISPARITY 90)
endif()
check_range(DISPARITY 0 4096)
if("${IMG_COLS}" STREQUAL "")
  math(EXPR IMG_COLS "(${PLANE_COLS} + ${WINDOW} + 1 + ${DISPARITY} + 1) / 2 * 2")
endif()
if("${IMG_ROWS}" STREQUAL "")
  math(EXPR IMG_ROWS "(${PLANE_ROWS} + ${WINDOW} + 1 + 1) / 2 * 2")
endif()
set(waves false)
if(WAVES)
  set(waves true)
endif()
foreach(key IMG_COLS IMG_ROWS)
  check_range(${key} 4 4096)
  math(EXPR odd "${${key}} % 2")
  if(odd)
    message(FATAL_ERROR "make_config: ${key}=${${key}} is odd")
  endif()
endforeach()

file(
  WRITE ${DIR}/${NAME}.json
  "{
  \"description\": \"added by make config\",
  \"img_cols\": ${IMG_COLS}, \"img_rows\": ${IMG_ROWS}, \"plane_cols\": ${PLANE_COLS}, \"plane_rows\": ${PLANE_ROWS},
  \"planes\": ${PLANES}, \"window\": ${WINDOW}, \"pix_bits\": ${PIX_BITS}, \"weight_bits\": ${WEIGHT_BITS},
  \"interp_frac\": ${INTERP_FRAC}, \"mncc_bits\": ${MNCC_BITS}, \"frac_bits\": ${FRAC_BITS}, \"lanes\": ${LANES},
  \"rectified\": ${RECTIFIED}, \"divider\": ${DIVIDER},
  \"waves\": ${waves}
}
")
message(STATUS "make_config: wrote ${DIR}/${NAME}.json")
