# SPDX-License-Identifier: Apache-2.0
# edited_sources(<out> <folder> <regex> <replacement> <source> ..): the sources in their order in `out`; one in which
# the regular expression is found is replaced by a copy in `folder`, edited.
function(edited_sources out folder regex replacement)
  set(sources)
  foreach(source IN LISTS ARGN)
    file(READ ${source} text)
    string(REGEX REPLACE "${regex}" "${replacement}" edited "${text}")
    if(NOT edited STREQUAL text)
      get_filename_component(name ${source} NAME)
      set(source ${folder}/${name})
      file(WRITE ${source} "${edited}")
    endif()
    list(APPEND sources ${source})
  endforeach()
  set(${out} ${sources} PARENT_SCOPE)
endfunction()
