# SPDX-License-Identifier: Apache-2.0
# edited_sources(<out> <folder> <regex> <replacement> <marker> <source> ..): the sources in their order in `out`; one in
# which the regular expression is found is replaced by a copy in `folder`, edited. The marker is a text that stands in
# every place which is to be edited: a source that has it more often than the expression is found is an error, so that
# nothing stays as it was because it is written in another way now.
function(edited_sources out folder regex replacement marker)
  set(sources)
  foreach(source IN LISTS ARGN)
    file(READ ${source} text)
    string(REGEX REPLACE "${regex}" "${replacement}" edited "${text}")
    string(REGEX REPLACE "${regex}" "<edited>" places "${text}")
    count_of("<edited>" "${places}" found)
    count_of("${marker}" "${text}" wanted)
    if(NOT found EQUAL wanted)
      message(FATAL_ERROR "${source}: ${wanted} places with '${marker}', ${found} of them understood")
    endif()
    if(NOT edited STREQUAL text)
      get_filename_component(name ${source} NAME)
      set(source ${folder}/${name})
      file(WRITE ${source} "${edited}")
    endif()
    list(APPEND sources ${source})
  endforeach()
  set(${out} ${sources} PARENT_SCOPE)
endfunction()

# How often a piece stands in a text.
function(count_of piece text out)
  string(REPLACE "${piece}" "" without "${text}")
  string(LENGTH "${piece}" one)
  string(LENGTH "${text}" all)
  string(LENGTH "${without}" rest)
  math(EXPR number "(${all} - ${rest}) / ${one}")
  set(${out} ${number} PARENT_SCOPE)
endfunction()
