# Fails when docs/profiles differs from the program's output: one page for each profile.
# usage: cmake -DBAUDGATE=PROGRAM -DPAGES=docs/profiles -P profiles_doc_test.cmake
# SPDX-License-Identifier: Apache-2.0
execute_process(COMMAND ${BAUDGATE} profiles --json OUTPUT_VARIABLE list COMMAND_ERROR_IS_FATAL ANY)
string(JSON count LENGTH "${list}")
if(count EQUAL 0)
  message(FATAL_ERROR "the program lists no profile")
endif()
file(GLOB pages RELATIVE ${PAGES} ${PAGES}/*.md)
math(EXPR last "${count} - 1")
foreach(i RANGE ${last})
  string(JSON name GET "${list}" ${i} profile)
  execute_process(COMMAND ${BAUDGATE} profiles ${name} --markdown
    OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
  set(page "")
  if(EXISTS ${PAGES}/${name}.md)
    file(READ ${PAGES}/${name}.md page)
  endif()
  if(NOT page STREQUAL printed)
    message(SEND_ERROR "docs/profiles/${name}.md is out of date; renew it with\n"
      "  baudgate profiles ${name} --markdown > docs/profiles/${name}.md")
  endif()
  list(REMOVE_ITEM pages ${name}.md)
endforeach()
if(pages)
  message(SEND_ERROR "docs/profiles has pages of profiles that are not shipped: ${pages}")
endif()
